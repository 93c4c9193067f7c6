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

/// Data that one pass passes to another. Resources are compared by object; the name is for people. Derived
/// types add contents.
class Resource {
 public:
  explicit Resource(std::string name, uint64_t size_bytes = 0)
      : name_(std::move(name)), size_bytes_(size_bytes) {}
  virtual ~Resource() = default;
  Resource(const Resource&) = delete;
  Resource& operator=(const Resource&) = delete;
  const std::string& name() const { return name_; }
  /// Returns the bytes of the resource when it is live, even before it is allocated; for coded data an upper
  /// bound.
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

/// Returns "kept", "not requested" or "unread".
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

/// Decides what runs by walking back from the wanted outputs. BadInput if a running pass reads a resource
/// that is neither external nor written by an earlier running pass. BadInput also if two passes or two
/// resources have the same name.
Result<PassPlan> make_pass_plan(const std::vector<PassDeclaration>& passes, const Resources& external,
                                const Resources& wanted);

}  // namespace strandcast::gl
