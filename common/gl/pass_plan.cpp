#include "common/gl/pass_plan.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

namespace strandcast::gl {
namespace {

using ResourceSet = std::set<const Resource*>;

std::vector<std::string> names_of(const Resources& resources) {
  std::vector<std::string> names;
  for (const Resource* resource : resources) names.push_back(resource->name());
  return names;
}

/// Every resource that the passes name, each once, in the order of the list.
Resources all_resources(const std::vector<PassDeclaration>& passes) {
  Resources all;
  ResourceSet seen;
  for (const PassDeclaration& pass : passes)
    for (const auto* resources : {&pass.reads, &pass.writes})
      for (const Resource* resource : *resources)
        if (seen.insert(resource).second) all.push_back(resource);
  return all;
}

/// Names are what people and metrics tell passes and resources apart by.
Status check_names(const std::vector<PassDeclaration>& passes, const Resources& resources) {
  std::set<std::string> pass_names;
  for (const PassDeclaration& pass : passes)
    if (!pass_names.insert(pass.name).second)
      return make_error(ErrorCode::BadInput, "pass '{}' is declared twice", pass.name);
  std::set<std::string> resource_names;
  for (const Resource* resource : resources)
    if (!resource_names.insert(resource->name()).second)
      return make_error(ErrorCode::BadInput, "two resources are called '{}'", resource->name());
  return {};
}

/// Every input of a running pass comes from outside or from a running pass before it.
Status check_inputs(const std::vector<PassDeclaration>& passes, const PassPlan& plan,
                    const Resources& external) {
  ResourceSet available(external.begin(), external.end());
  for (size_t i = 0; i < passes.size(); ++i) {
    if (plan.passes[i].fate != PassFate::Kept) continue;
    for (const Resource* resource : passes[i].reads)
      if (!available.contains(resource))
        return make_error(ErrorCode::BadInput, "pass '{}' reads '{}', which no running pass before it writes",
                          passes[i].name, resource->name());
    available.insert(passes[i].writes.begin(), passes[i].writes.end());
  }
  return {};
}

}  // namespace

const char* to_string(PassFate fate) {
  switch (fate) {
    case PassFate::Kept:
      return "kept";
    case PassFate::NotRequested:
      return "not requested";
    case PassFate::Unread:
      return "unread";
  }
  return "?";
}

bool PassPlan::runs(std::string_view pass) const {
  return std::any_of(passes.begin(), passes.end(), [&](const PassDecision& decision) {
    return decision.name == pass && decision.fate == PassFate::Kept;
  });
}

bool PassPlan::is_live(const Resource& resource) const {
  return std::find(live.begin(), live.end(), &resource) != live.end();
}

Result<PassPlan> make_pass_plan(const std::vector<PassDeclaration>& passes, const Resources& external,
                                const Resources& wanted) {
  const Resources resources = all_resources(passes);
  RETURN_IF_ERROR(check_names(passes, resources));
  PassPlan plan;
  ResourceSet used;
  // Of each needed resource: a pass after this one, or the outside.
  std::map<const Resource*, std::string> reader;
  for (const Resource* resource : wanted) reader[resource] = "the outside";
  for (auto pass = passes.rbegin(); pass != passes.rend(); ++pass) {
    PassDecision decision{pass->name, PassFate::Unread, {}};
    const auto needed = std::find_if(pass->writes.begin(), pass->writes.end(),
                                     [&](const Resource* resource) { return reader.contains(resource); });
    if (!pass->is_enabled) {
      decision.fate = PassFate::NotRequested;
      decision.reason = pass->disabled_reason;
    } else if (needed == pass->writes.end()) {
      decision.reason = pass->writes.empty()
                            ? "it writes nothing"
                            : fmt::format("nothing reads {}", fmt::join(names_of(pass->writes), ", "));
    } else {
      decision.fate = PassFate::Kept;
      decision.reason = fmt::format("writes {} for {}", (*needed)->name(), reader[*needed]);
      for (const Resource* resource : pass->reads) reader.try_emplace(resource, pass->name);
      used.insert(pass->reads.begin(), pass->reads.end());
      used.insert(pass->writes.begin(), pass->writes.end());
    }
    plan.passes.push_back(std::move(decision));
  }
  std::reverse(plan.passes.begin(), plan.passes.end());
  RETURN_IF_ERROR(check_inputs(passes, plan, external));
  for (const Resource* resource : resources) {
    if (std::find(external.begin(), external.end(), resource) != external.end()) continue;
    const bool is_live = used.contains(resource);
    if (is_live) plan.live.push_back(resource);
    (is_live ? plan.live_bytes : plan.saved_bytes) += resource->size_bytes();
  }
  return plan;
}

}  // namespace strandcast::gl
