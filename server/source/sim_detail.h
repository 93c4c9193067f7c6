// SimDetail: chooses how much is simulated from the size at which readers see the hair. The level rises at
// once, so that nobody sees too little. It falls one level at a time after a delay, so that nothing flickers.
// Pure logic: times are passed in.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "common/scene/features.h"

namespace strandcast {

/// Size of the hair on the largest screen below which each level begins, relative to DetailDesc::full_at_px.
inline constexpr double kLevelShares[kDetailLevels - 1] = {1.0, 0.5, 0.25, 0.125, 0.0625};

/// What all readers together see of the hair.
struct ReaderSight {
  bool has_readers = false;
  /// Height of the hair on the largest screen in pixels. Infinity: a reader did not say, or records states.
  /// 0: the hair is in no picture.
  double hair_px = std::numeric_limits<double>::infinity();
};

/// Returns the level for hair of this height, without hysteresis.
DetailLevel level_for(const DetailDesc& desc, double hair_px);

class SimDetail {
 public:
  explicit SimDetail(const DetailDesc& desc) : desc_(desc) {}
  /// Changes the description from the next update() on.
  void change(const DetailDesc& desc) { desc_ = desc; }

  /// Updates the level; call it often. Returns true if it has changed.
  bool update(const ReaderSight& sight, int64_t time_ns);

  DetailLevel level() const { return level_; }
  /// Returns why the level is not Full, for a person; empty at Full.
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
