// Pass plan: which declared passes run. A pass runs when it is enabled and something it writes is wanted,
// directly or through other passes that run. Pure logic, no GL, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace strandcast::gl {

struct PassDeclaration {
  std::string name;
  bool is_enabled = true;
  std::string disabled_reason;     // shown when not enabled: which fact, and why
  std::vector<std::string> reads;  // resource names
  std::vector<std::string> writes;
};

struct ResourceDeclaration {
  std::string name;
  uint64_t size_bytes = 0;
};

enum class PassFate { Kept, NotRequested, Unread };  // runs | its fact is off | nothing wants what it writes

struct PassDecision {
  std::string name;
  PassFate fate = PassFate::Kept;
  std::string reason;
};

struct PassPlan {
  std::vector<PassDecision> passes;         // in declaration order
  std::vector<std::string> live_resources;  // to be allocated
  uint64_t live_bytes = 0;
  uint64_t saved_bytes = 0;  // declared but not live

  bool runs(const std::string& pass) const;
  bool is_live(const std::string& resource) const;
};

/// Walks back from the wanted outputs. BadInput when a pass that runs reads what no running pass before it
/// writes and no declared external resource provides.
Result<PassPlan> make_pass_plan(const std::vector<PassDeclaration>& passes,
                                const std::vector<ResourceDeclaration>& resources,
                                const std::vector<std::string>& external,
                                const std::vector<std::string>& wanted);

}  // namespace strandcast::gl
