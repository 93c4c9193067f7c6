#include "common/pictures/h264_header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "common/pictures/image_check.h"

namespace strandcast {
namespace {

// Kinds of units, ITU-T H.264, table 7-1.
constexpr uint32_t kSlice = 1, kKeySlice = 5, kExtra = 6, kSequence = 7, kPicture = 8, kDelimiter = 9;
constexpr uint32_t kMacroblock = 16;
constexpr size_t kMaxSequenceBytes = 256;
constexpr uint32_t kMaxGolombZeros = 31;
/// Profiles whose sequence parameters say more about colours (7.3.2.1.1).
constexpr std::array<uint32_t, 13> kHighProfiles = {100, 110, 122, 244, 44,  83, 86,
                                                    118, 128, 138, 139, 134, 135};

/// Bits from the highest on, without the bytes that only keep start codes away (7.4.1). At the end come
/// zeros.
class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> unit) {
    size_t zeros = 0;
    for (const std::byte byte : unit.first(std::min(unit.size(), kMaxSequenceBytes))) {
      const bool is_guard = zeros >= 2 && byte == std::byte{3};
      zeros = byte == std::byte{0} ? zeros + 1 : 0;
      if (!is_guard) bytes_.push_back(std::to_integer<uint8_t>(byte));
    }
  }
  bool ok() const { return ok_; }
  uint32_t take(uint32_t count) {
    uint32_t value = 0;
    for (uint32_t i = 0; i < count; ++i) value = value << 1 | take_bit();
    return value;
  }
  /// An Exp-Golomb number (9.1).
  uint32_t take_number() {
    uint32_t zeros = 0;
    while (ok_ && take_bit() == 0)
      if (++zeros > kMaxGolombZeros) ok_ = false;
    return ok_ ? (1u << zeros) - 1 + take(zeros) : 0;
  }

 private:
  uint32_t take_bit() {
    if (at_ >= 8 * bytes_.size()) {
      ok_ = false;
      return 0;
    }
    const uint32_t bit = bytes_[at_ / 8] >> (7 - at_ % 8) & 1u;
    ++at_;
    return bit;
  }

  std::vector<uint8_t> bytes_;
  size_t at_ = 0;
  bool ok_ = true;
};

Status check_colours(BitReader& reader) {
  const uint32_t format = reader.take_number();
  const uint32_t more_luma_bits = reader.take_number(), more_colour_bits = reader.take_number();
  const uint32_t is_lossless = reader.take(1), has_matrices = reader.take(1);
  if (format != 1 || more_luma_bits != 0 || more_colour_bits != 0 || is_lossless != 0 || has_matrices != 0)
    return make_error(ErrorCode::Unsupported, "H.264 with colour format {} and {} bits is not shown here",
                      format, 8 + more_luma_bits);
  return {};
}

Status check_counting(BitReader& reader) {
  (void)reader.take_number();  // digits of frame numbers
  const uint32_t order = reader.take_number();
  if (order == 0) (void)reader.take_number();
  if (order != 0 && order != 2)
    return make_error(ErrorCode::Unsupported, "H.264 pictures in order {} are not shown here", order);
  const uint32_t references = reader.take_number();
  if (references > kMaxVideoReferences)
    return make_error(ErrorCode::LimitExceeded, "H.264 that refers to {} pictures, allowed are {}",
                      references, kMaxVideoReferences);
  if (reader.take(1) != 0) return make_error(ErrorCode::Unsupported, "H.264 with gaps is not shown here");
  return {};
}

/// 7.3.2.1.1, up to the size.
Result<VideoFrameInfo> read_fields(BitReader& reader) {
  const uint32_t profile = reader.take(8);
  (void)reader.take(16);       // constraints and level
  (void)reader.take_number();  // its number
  if (std::find(kHighProfiles.begin(), kHighProfiles.end(), profile) != kHighProfiles.end())
    RETURN_IF_ERROR(check_colours(reader));
  RETURN_IF_ERROR(check_counting(reader));
  const uint64_t columns = uint64_t{reader.take_number()} + 1, rows = uint64_t{reader.take_number()} + 1;
  if (reader.take(1) == 0) return make_error(ErrorCode::Unsupported, "interlaced H.264 is not shown here");
  (void)reader.take(1);
  uint64_t cut_right = 0, cut_below = 0;
  if (reader.take(1) != 0) {
    const uint32_t left = reader.take_number();
    cut_right = 2 * uint64_t{reader.take_number()};
    const uint32_t above = reader.take_number();
    cut_below = 2 * uint64_t{reader.take_number()};
    if (left != 0 || above != 0 || cut_right >= kMacroblock || cut_below >= kMacroblock)
      return make_error(ErrorCode::BadInput, "an H.264 picture is cut by {}, {}, {} and {} pixels", 2 * left,
                        cut_right, 2 * above, cut_below);
  }
  const uint64_t width = columns * kMacroblock - cut_right, height = rows * kMacroblock - cut_below;
  RETURN_IF_ERROR(check_picture_size(width, height));
  return VideoFrameInfo{true, static_cast<uint32_t>(width), static_cast<uint32_t>(height)};
}

Result<VideoFrameInfo> read_sequence(std::span<const std::byte> unit) {
  BitReader reader(unit);
  Result<VideoFrameInfo> info = read_fields(reader);
  if (!reader.ok())  // then zeros have been judged
    return make_error(ErrorCode::BadInput, "H.264 sequence parameters of {} bytes end early", unit.size());
  return info;
}

/// Where the next start code 00 00 01 begins; the size when there is none.
size_t find_start(std::span<const std::byte> bytes, size_t from) {
  for (size_t i = from; i + 3 <= bytes.size(); ++i)
    if (bytes[i] == std::byte{0} && bytes[i + 1] == std::byte{0} && bytes[i + 2] == std::byte{1}) return i;
  return bytes.size();
}

/// What has been seen of a frame.
struct Seen {
  size_t units = 0, slices = 0, key_slices = 0, pictures = 0;
  std::optional<VideoFrameInfo> sequence;
};

Status take_unit(std::span<const std::byte> unit, Seen& seen) {
  if (unit.empty()) return make_error(ErrorCode::BadInput, "an empty H.264 unit");
  if (++seen.units > kMaxH264Units)
    return make_error(ErrorCode::LimitExceeded, "an H.264 frame of more than {} units", kMaxH264Units);
  const uint32_t kind = std::to_integer<uint32_t>(unit[0]) & 0x9f;  // the highest bit is 0
  switch (kind) {
    case kSlice:
      ++seen.slices;
      return {};
    case kKeySlice:
      ++seen.key_slices;
      return {};
    case kSequence: {
      if (seen.sequence) return make_error(ErrorCode::BadInput, "an H.264 frame with two sequences");
      ASSIGN_OR_RETURN(seen.sequence, read_sequence(unit.subspan(1)));
      return {};
    }
    case kPicture:
      ++seen.pictures;
      return {};
    case kExtra:
    case kDelimiter:
      return {};
    default:
      return make_error(ErrorCode::BadInput, "an H.264 unit of kind {}", kind);
  }
}

}  // namespace

Result<VideoFrameInfo> read_h264_info(std::span<const std::byte> frame) {
  Seen seen;
  size_t start = find_start(frame, 0);
  if (std::any_of(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(start),
                  [](std::byte byte) { return byte != std::byte{0}; }) ||
      start == frame.size())
    return make_error(ErrorCode::BadInput, "an H.264 frame of {} bytes does not begin with a unit",
                      frame.size());
  while (start < frame.size()) {
    const size_t begin = start + 3;
    start = find_start(frame, begin);
    RETURN_IF_ERROR(take_unit(frame.subspan(begin, start - begin), seen));
  }
  const bool is_key = seen.sequence && seen.pictures > 0 && seen.key_slices > 0 && seen.slices == 0;
  const bool is_delta = !seen.sequence && seen.pictures == 0 && seen.key_slices == 0 && seen.slices > 0;
  if (!is_key && !is_delta)
    return make_error(ErrorCode::BadInput, "an H.264 frame of {} key slices and {} others is neither",
                      seen.key_slices, seen.slices);
  return is_key ? *seen.sequence : VideoFrameInfo{};
}

}  // namespace strandcast
