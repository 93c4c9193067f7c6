// Pass plan: which declared passes run. A pass runs when it is enabled and something it writes is wanted,
// directly or through other passes that run. Pure logic, no GL, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace strandcast::gl {

/// What one pass hands to another. Which one is meant is told by the object, its name is for people; types
/// with contents derive from it.
class Resource {
 public:
  explicit Resource(std::string name, uint64_t size_bytes = 0)
      : name_(std::move(name)), size_bytes_(size_bytes) {}
  virtual ~Resource() = default;
  Resource(const Resource&) = delete;
  Resource& operator=(const Resource&) = delete;
  const std::string& name() const { return name_; }
  /// Bytes it takes when it is live, whether or not it is there yet; an upper bound for what is coded.
  virtual uint64_t size_bytes() const { return size_bytes_; }

 private:
  std::string name_;
  uint64_t size_bytes_ = 0;
};

using Resources = std::vector<const Resource*>;

struct PassDeclaration {
  std::string name;
  Resources reads;
  Resources writes;
  bool is_enabled = true;
  std::string disabled_reason;  // shown when not enabled: which fact, and why
};

enum class PassFate { Kept, NotRequested, Unread };  // runs | its fact is off | nothing wants what it writes

/// As printed: "kept", "not requested", "unread".
const char* to_string(PassFate fate);

struct PassDecision {
  std::string name;
  PassFate fate = PassFate::Kept;
  std::string reason;
};

struct PassPlan {
  std::vector<PassDecision> passes;  // in declaration order
  Resources live;                    // to be allocated: used by a pass that runs, and not from outside
  uint64_t live_bytes = 0;
  uint64_t saved_bytes = 0;  // declared but not live

  bool runs(std::string_view pass) const;
  bool is_live(const Resource& resource) const;
};

/// Walks back from the wanted outputs. BadInput when a pass that runs reads what no running pass before it
/// writes and what is not external, and when two passes or two resources have one name.
Result<PassPlan> make_pass_plan(const std::vector<PassDeclaration>& passes, const Resources& external,
                                const Resources& wanted);

}  // namespace strandcast::gl
