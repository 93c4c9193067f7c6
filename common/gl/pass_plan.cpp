#include "common/gl/pass_plan.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

namespace strandcast::gl {
namespace {

using Names = std::set<std::string>;

Status check_names(const std::vector<PassDeclaration>& passes,
                   const std::vector<ResourceDeclaration>& resources,
                   const std::vector<std::string>& external, const std::vector<std::string>& wanted) {
  Names known(external.begin(), external.end());
  Names declared;
  for (const ResourceDeclaration& resource : resources) {
    if (!declared.insert(resource.name).second)
      return make_error(ErrorCode::BadInput, "resource '{}' is declared twice", resource.name);
    known.insert(resource.name);
  }
  Names pass_names;
  for (const PassDeclaration& pass : passes) {
    if (!pass_names.insert(pass.name).second)
      return make_error(ErrorCode::BadInput, "pass '{}' is declared twice", pass.name);
    for (const auto* names : {&pass.reads, &pass.writes})
      for (const std::string& name : *names)
        if (!known.contains(name))
          return make_error(ErrorCode::BadInput, "pass '{}' uses the undeclared resource '{}'", pass.name,
                            name);
  }
  for (const std::string& name : wanted)
    if (!known.contains(name))
      return make_error(ErrorCode::BadInput, "the wanted resource '{}' is undeclared", name);
  return {};
}

/// Every input of a running pass comes from outside or from a running pass before it.
Status check_inputs(const std::vector<PassDeclaration>& passes, const PassPlan& plan,
                    const std::vector<std::string>& external) {
  Names available(external.begin(), external.end());
  for (const PassDeclaration& pass : passes) {
    if (!plan.runs(pass.name)) continue;
    for (const std::string& name : pass.reads)
      if (!available.contains(name))
        return make_error(ErrorCode::BadInput, "pass '{}' reads '{}', which no running pass before it writes",
                          pass.name, name);
    available.insert(pass.writes.begin(), pass.writes.end());
  }
  return {};
}

}  // namespace

bool PassPlan::runs(const std::string& pass) const {
  return std::any_of(passes.begin(), passes.end(), [&](const PassDecision& decision) {
    return decision.name == pass && decision.fate == PassFate::Kept;
  });
}

bool PassPlan::is_live(const std::string& resource) const {
  return std::find(live_resources.begin(), live_resources.end(), resource) != live_resources.end();
}

Result<PassPlan> make_pass_plan(const std::vector<PassDeclaration>& passes,
                                const std::vector<ResourceDeclaration>& resources,
                                const std::vector<std::string>& external,
                                const std::vector<std::string>& wanted) {
  RETURN_IF_ERROR(check_names(passes, resources, external, wanted));
  PassPlan plan;
  Names used;
  std::map<std::string, std::string>
      reader;  // of each needed resource: a pass after this one, or the outside
  for (const std::string& name : wanted) reader[name] = "the outside";
  for (auto pass = passes.rbegin(); pass != passes.rend(); ++pass) {
    PassDecision decision{pass->name, PassFate::Unread, {}};
    const auto needed = std::find_if(pass->writes.begin(), pass->writes.end(),
                                     [&](const std::string& name) { return reader.contains(name); });
    if (!pass->is_enabled) {
      decision.fate = PassFate::NotRequested;
      decision.reason = pass->disabled_reason;
    } else if (needed == pass->writes.end()) {
      decision.reason = pass->writes.empty() ? "it writes nothing"
                                             : fmt::format("nothing reads {}", fmt::join(pass->writes, ", "));
    } else {
      decision.fate = PassFate::Kept;
      decision.reason = fmt::format("writes {} for {}", *needed, reader[*needed]);
      for (const std::string& name : pass->reads) reader.try_emplace(name, pass->name);
      used.insert(pass->reads.begin(), pass->reads.end());
      used.insert(pass->writes.begin(), pass->writes.end());
    }
    plan.passes.push_back(std::move(decision));
  }
  std::reverse(plan.passes.begin(), plan.passes.end());
  RETURN_IF_ERROR(check_inputs(passes, plan, external));
  for (const ResourceDeclaration& resource : resources) {
    const bool is_live = used.contains(resource.name);
    if (is_live) plan.live_resources.push_back(resource.name);
    (is_live ? plan.live_bytes : plan.saved_bytes) += resource.size_bytes;
  }
  return plan;
}

}  // namespace strandcast::gl
