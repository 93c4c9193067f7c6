// SimDetail: decides how much is simulated, from what readers see of the hair and for how long. Up at once,
// so that nobody sees too little; down a level at a time and only after a while, so that nothing flickers.
// Pure logic: times are passed in.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "common/scene/features.h"

namespace strandcast {

/// Size of the hair on the largest screen below which a level begins, of DetailDesc::full_at_px.
inline constexpr double kLevelShares[kDetailLevels - 1] = {1.0, 0.5, 0.25, 0.125, 0.0625};

/// What all readers together see.
struct ReaderSight {
  bool has_readers = false;
  /// Height of the hair on the largest screen; infinity: somebody did not say, or takes states down. 0: it is
  /// in no picture.
  double hair_px = std::numeric_limits<double>::infinity();
};

/// The level for hair of this height, without memory.
DetailLevel level_for(const DetailDesc& desc, double hair_px);

class SimDetail {
 public:
  explicit SimDetail(const DetailDesc& desc) : desc_(desc) {}
  /// Counts from the next update().
  void change(const DetailDesc& desc) { desc_ = desc; }

  /// Call often. True when the level changed.
  bool update(const ReaderSight& sight, int64_t time_ns);

  DetailLevel level() const { return level_; }
  /// For a person; empty at Full.
  const std::string& reason() const { return reason_; }

 private:
  DetailLevel lowest(const ReaderSight& sight) const;
  double wait_s(const ReaderSight& sight) const;
  bool set(DetailLevel level, const ReaderSight& sight);

  DetailDesc desc_;
  DetailLevel level_ = DetailLevel::Full;
  std::string reason_;
  std::optional<int64_t> lower_since_ns_;  // a lower level would do since then
  bool was_read_ = true;                   // by somebody, since then
};

}  // namespace strandcast
