#include "server/net/stream_list.h"

namespace strandcast {

std::vector<StreamList::Class> listed_classes(std::span<const StrandClass> classes) {
  std::vector<StreamList::Class> listed;
  for (const StrandClass& row : classes)
    if (listed.size() < kMaxListedClasses)
      listed.push_back({row.rate_divisor, row.strand_share, row.coarsening, row.bound_m, row.frame_rate_hz});
  return listed;
}

std::vector<StrandClass> strand_classes_of(const StreamList& list) {
  std::vector<StrandClass> classes;
  for (const StreamList::Class& row : list.classes)
    classes.push_back({row.rate_divisor, row.strand_share, row.coarsening, row.bound_m, row.frame_rate_hz});
  if (classes.empty()) classes.emplace_back();
  return classes;
}

}  // namespace strandcast
