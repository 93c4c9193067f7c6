#include "common/gl/pass_list.h"

#include <algorithm>
#include <set>

namespace strandcast::gl {

PassReport make_report(std::string name, PassFate fate, std::string reason, const StageTimer& timer) {
  return {std::move(name), fate, std::move(reason), 0, timer.count(), timer.median_ms()};
}

Status PassListBase::plan(const Resources& external, const Resources& wanted) {
  std::vector<PassDeclaration> declarations;
  for (const Slot& slot : slots_) declarations.push_back(slot.entry->declaration());
  ASSIGN_OR_RETURN(plan_, make_pass_plan(declarations, external, wanted));
  external_ = external;
  for (size_t i = 0; i < slots_.size(); ++i) slots_[i].is_kept = plan_.passes[i].fate == PassFate::Kept;
  return {};
}

PassReports PassListBase::report() const {
  PassReports reports;
  std::set<const Resource*> counted;
  for (size_t i = 0; i < slots_.size() && i < plan_.passes.size(); ++i) {
    const PassEntry& entry = *slots_[i].entry;
    const PassDecision& decision = plan_.passes[i];
    PassReport report{decision.name, decision.fate, decision.reason, entry.size_bytes(), 0, 0.0};
    for (const Resource* resource : entry.declaration().writes)
      if (counted.insert(resource).second) report.size_bytes += resource->size_bytes();
    report.runs = entry.timer().count();
    report.median_ms = entry.timer().median_ms();
    reports.push_back(std::move(report));
  }
  return reports;
}

double PassListBase::last_ms(std::string_view pass) const {
  double ms = 0.0;
  for (const Slot& slot : slots_)
    if (slot.entry->declaration().name == pass) ms += slot.last_ms;
  return ms;
}

double PassListBase::last_total_ms() const {
  double ms = 0.0;
  for (const Slot& slot : slots_) ms += slot.last_ms;
  return ms;
}

uint64_t PassListBase::bytes(bool is_live) const {
  uint64_t sum = 0;
  std::set<const Resource*> counted(external_.begin(), external_.end());
  for (const Slot& slot : slots_) {
    if (slot.is_kept == is_live) sum += slot.entry->size_bytes();
    const PassDeclaration& declaration = slot.entry->declaration();
    for (const auto* resources : {&declaration.reads, &declaration.writes})
      for (const Resource* resource : *resources)
        if (plan_.is_live(*resource) == is_live && counted.insert(resource).second)
          sum += resource->size_bytes();
  }
  return sum;
}

uint64_t PassListBase::live_bytes() const {
  return bytes(true);
}

uint64_t PassListBase::saved_bytes() const {
  return bytes(false);
}

void PassListBase::begin_run() {
  for (Slot& slot : slots_) slot.last_ms = 0.0;
}

void PassListBase::end_run() {
  for (Slot& slot : slots_)
    if (slot.is_kept) slot.entry->timer().add_ms(slot.last_ms);
}

}  // namespace strandcast::gl
