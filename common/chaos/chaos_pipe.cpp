#include "common/chaos/chaos_pipe.h"

#include <algorithm>
#include <cmath>

#include "common/base/units.h"

namespace strandcast::chaos {
namespace {

/// Uniform in [0, 1), the same on every machine.
double unit(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

}  // namespace

size_t ChaosPipe::room(int64_t time_us) const {
  if (is_frozen(time_us) || held_bytes_ >= kMaxHeldBytes) return 0;
  if (plan_.bytes_per_s == 0) return kMaxHeldBytes - held_bytes_;
  // The queue is what waits for the rate, and what has crossed and the receiver does not take; the rest is on
  // its way.
  size_t queued = 0;
  auto piece = pieces_.rbegin();
  for (; piece != pieces_.rend() && piece->crossed_us > time_us; ++piece) queued += piece->bytes.size();
  const auto crossed = pieces_.size() - static_cast<size_t>(piece - pieces_.rbegin());
  for (size_t i = 0; i < crossed && pieces_[i].due_us <= time_us; ++i) queued += pieces_[i].bytes.size();
  return queued >= plan_.queue_bytes ? 0 : plan_.queue_bytes - queued;
}

void ChaosPipe::push(std::span<const std::byte> bytes, int64_t time_us) {
  while (!bytes.empty()) {
    const size_t size = std::min(bytes.size(), kSegmentBytes);
    push_segment(bytes.first(size), time_us);
    bytes = bytes.subspan(size);
  }
}

void ChaosPipe::push_segment(std::span<const std::byte> bytes, int64_t time_us) {
  std::vector<std::byte> copy(bytes.begin(), bytes.end());
  corrupt(copy);
  pushed_bytes_ += copy.size();
  held_bytes_ += copy.size();
  link_free_us_ = std::max(link_free_us_, static_cast<double>(time_us));
  if (plan_.bytes_per_s > 0)
    link_free_us_ += static_cast<double>(copy.size()) * kUsPerS / static_cast<double>(plan_.bytes_per_s);
  const auto crossed_us = static_cast<int64_t>(link_free_us_);
  int64_t due_us = crossed_us + plan_.delay_us;
  if (plan_.jitter_us > 0)
    due_us += static_cast<int64_t>(unit(jitter_random_) * static_cast<double>(plan_.jitter_us));
  due_us += resends_us();
  if (plan_.writes == Writes::Merged) due_us = (due_us / kMergeWindowUs + 1) * kMergeWindowUs;
  last_due_us_ = std::max(last_due_us_, due_us);
  if (plan_.writes == Writes::Merged && !pieces_.empty() && pieces_.back().due_us == last_due_us_) {
    pieces_.back().bytes.insert(pieces_.back().bytes.end(), copy.begin(), copy.end());
    pieces_.back().crossed_us = crossed_us;
  } else {
    pieces_.push_back({crossed_us, last_due_us_, std::move(copy), 0});
  }
}

/// How much later a segment comes that is lost, and lost again.
int64_t ChaosPipe::resends_us() {
  constexpr int kMostResends = 16;
  int64_t resends = 0;
  while (plan_.loss > 0.0 && resends < kMostResends && unit(loss_random_) < plan_.loss) ++resends;
  return resends * (2 * plan_.delay_us + kResendUs);
}

/// The gaps between wrong bytes are drawn, not the bytes one by one, so they do not depend on how bytes
/// arrive.
void ChaosPipe::corrupt(std::span<std::byte> bytes) {
  if (plan_.corrupt_per_byte <= 0.0) return;
  const auto draw = [this] {
    const double gap =
        std::log1p(-unit(corrupt_random_)) / std::log1p(-std::min(plan_.corrupt_per_byte, 0.5));
    return 1 + static_cast<uint64_t>(std::min(gap, 1e18));
  };
  if (corrupt_in_ == 0) corrupt_in_ = draw();
  size_t position = 0;
  while (corrupt_in_ <= bytes.size() - position) {
    position += corrupt_in_;
    bytes[position - 1] ^= std::byte{1} << static_cast<int>(corrupt_random_() % 8);
    ++corrupted_bytes_;
    corrupt_in_ = draw();
  }
  corrupt_in_ -= bytes.size() - position;
}

size_t ChaosPipe::cut_bytes() const {
  if (plan_.writes == Writes::OneByte) return 1;
  if (plan_.writes == Writes::Split) return 1 + next_cut_ % kMaxSplitBytes;
  return kMaxHeldBytes;
}

std::span<const std::byte> ChaosPipe::front(int64_t time_us) const {
  if (pieces_.empty() || pieces_.front().due_us > time_us || is_frozen(time_us)) return {};
  const Piece& piece = pieces_.front();
  const std::span<const std::byte> rest = std::span(piece.bytes).subspan(piece.written);
  return rest.first(std::min(rest.size(), cut_bytes()));
}

void ChaosPipe::pop(size_t byte_count) {
  Piece& piece = pieces_.front();
  piece.written += byte_count;
  held_bytes_ -= byte_count;
  next_cut_ = cut_random_();
  if (piece.written == piece.bytes.size()) pieces_.pop_front();
}

bool ChaosPipe::is_frozen(int64_t time_us) const {
  if (plan_.freeze_every_us <= 0 || plan_.freeze_us <= 0) return false;
  return time_us % plan_.freeze_every_us >= plan_.freeze_every_us - plan_.freeze_us;
}

int64_t ChaosPipe::next_due_us(int64_t time_us) const {
  if (is_frozen(time_us)) return (time_us / plan_.freeze_every_us + 1) * plan_.freeze_every_us;
  return pieces_.empty() ? -1 : std::max(pieces_.front().due_us, time_us);
}

}  // namespace strandcast::chaos
