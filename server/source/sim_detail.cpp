#include "server/source/sim_detail.h"

#include <fmt/format.h>

#include <utility>

#include "common/base/units.h"

namespace strandcast {
namespace {

DetailLevel next_lower(DetailLevel level) {
  return static_cast<DetailLevel>(static_cast<int>(level) + 1);
}

std::string reason_of(const DetailDesc& desc, const ReaderSight& sight) {
  if (!sight.has_readers) return fmt::format("nobody has read for {:g} s", desc.idle_after_s);
  if (sight.hair_px <= 0.0) return "the hair is in nobody's picture";
  return fmt::format("the hair is {:.0f} pixels high on the largest screen: all from {:g} on", sight.hair_px,
                     desc.full_at_px);
}

}  // namespace

DetailLevel level_for(const DetailDesc& desc, double hair_px) {
  auto level = DetailLevel::Full;
  for (const double share : kLevelShares)
    if (hair_px < share * desc.full_at_px) level = next_lower(level);
  return level;
}

/// The lowest level that does, with room for hair that grows again.
DetailLevel SimDetail::lowest(const ReaderSight& sight) const {
  if (!sight.has_readers) return desc_.idle == kIdleFollow ? DetailLevel::FollowHead : DetailLevel::Full;
  if (desc_.mode != kDetailAuto) return DetailLevel::Full;
  return level_for(desc_, sight.hair_px / (1.0 - desc_.hysteresis));
}

double SimDetail::wait_s(const ReaderSight& sight) const {
  return sight.has_readers ? desc_.settle_s : desc_.idle_after_s;
}

bool SimDetail::update(const ReaderSight& sight, int64_t time_ns) {
  // Hair that nobody reads needs nothing, and comes back by itself when somebody does.
  if (sight.has_readers || desc_.idle != kIdleFollow) {
    const bool is_by_size = sight.has_readers && desc_.mode == kDetailAuto;
    const DetailLevel needed = is_by_size ? level_for(desc_, sight.hair_px) : DetailLevel::Full;
    if (needed < level_) return set(needed, sight);
  }
  const DetailLevel lowest_now = lowest(sight);
  if (lowest_now <= level_) {
    lower_since_ns_.reset();
    return false;
  }
  if (!lower_since_ns_ || was_read_ != sight.has_readers) lower_since_ns_ = time_ns;
  was_read_ = sight.has_readers;
  if (static_cast<double>(time_ns - *lower_since_ns_) < wait_s(sight) * kNsPerS) return false;
  lower_since_ns_ = time_ns;
  return set(sight.has_readers ? next_lower(level_) : lowest_now, sight);
}

bool SimDetail::set(DetailLevel level, const ReaderSight& sight) {
  if (level <= level_) lower_since_ns_.reset();
  level_ = level;
  reason_ = level == DetailLevel::Full ? std::string() : reason_of(desc_, sight);
  return true;
}

}  // namespace strandcast
