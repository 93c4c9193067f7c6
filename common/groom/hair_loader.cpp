#include "common/groom/hair_loader.h"

#include <algorithm>
#include <string>

#include "common/base/file.h"
#include "common/base/mercy.h"
#include "common/groom/usable_strands.h"

namespace strandcast {
namespace {

constexpr uint64_t kHeaderBytes = 128;
constexpr uint64_t kStrandCountAt = 4, kPointCountAt = 8, kArraysAt = 12, kDefaultSegmentsAt = 16;
constexpr uint32_t kSegmentsBit = 1, kPointsBit = 2, kThicknessBit = 4, kTransparencyBit = 8, kColourBit = 16;
constexpr uint32_t kKnownBits = 31;
constexpr uint64_t kPointBytes = 3 * sizeof(float);

struct HairHeader {
  uint32_t strand_count = 0;
  uint32_t point_count = 0;
  uint32_t arrays = 0;
  uint32_t default_segments = 0;
  bool has(uint32_t bit) const { return (arrays & bit) != 0; }
};

uint64_t expected_bytes(const HairHeader& header) {
  const uint64_t points = header.point_count;
  uint64_t bytes = kHeaderBytes + points * kPointBytes;
  if (header.has(kSegmentsBit)) bytes += uint64_t{header.strand_count} * sizeof(uint16_t);
  if (header.has(kThicknessBit)) bytes += points * sizeof(float);
  if (header.has(kTransparencyBit)) bytes += points * sizeof(float);
  if (header.has(kColourBit)) bytes += points * kPointBytes;
  return bytes;
}

Result<HairHeader> read_hair_header(const ByteView& file) {
  if (!file.has(0, kHeaderBytes, 1)) {
    return make_error(ErrorCode::BadInput, "{} bytes, a .hair header alone has {}", file.size_bytes(),
                      kHeaderBytes);
  }
  const std::string magic{file.get<char>(0), file.get<char>(1), file.get<char>(2), file.get<char>(3)};
  if (magic != "HAIR" && magic != "hair") {
    return make_error(ErrorCode::BadInput, "does not begin with 'HAIR' or 'hair': not a .hair file");
  }
  const HairHeader header{file.get<uint32_t>(kStrandCountAt), file.get<uint32_t>(kPointCountAt),
                          file.get<uint32_t>(kArraysAt), file.get<uint32_t>(kDefaultSegmentsAt)};
  if (header.strand_count == 0) return make_error(ErrorCode::BadInput, "0 strands");
  if (header.strand_count > kMaxStrandCount) {
    return make_error(ErrorCode::LimitExceeded, "{} strands, at most {} are allowed: export fewer of them",
                      header.strand_count, kMaxStrandCount);
  }
  if (header.point_count > kMaxGroomVertices) {
    return make_error(ErrorCode::LimitExceeded, "{} points, at most {} are allowed", header.point_count,
                      kMaxGroomVertices);
  }
  if ((header.arrays & ~kKnownBits) != 0) {
    return make_error(ErrorCode::BadInput, "array bits {:#x}, known are 1, 2, 4, 8 and 16", header.arrays);
  }
  if (!header.has(kPointsBit)) {
    return make_error(ErrorCode::BadInput, "array bits {:#x} say that there are no points", header.arrays);
  }
  return header;
}

/// Judges a file that is cut off, or that goes on behind its arrays.
Status check_size(const ByteView& file, const HairHeader& header, std::vector<std::string>& notes) {
  const uint64_t expected = expected_bytes(header), size = file.size_bytes();
  if (expected == size) return {};
  BadItems wrong;
  wrong.add(
      make_error(ErrorCode::BadInput, "{} bytes, but {} strands, {} points and array bits {:#x} need {}",
                 size, header.strand_count, header.point_count, header.arrays, expected),
      std::max(expected, size) - std::min(expected, size));
  return wrong.settle(std::max(expected, size), "bytes",
                      size < expected ? "since the file is cut off" : "and are left out", notes);
}

/// First vertex of each strand.
Result<std::vector<uint32_t>> read_offsets(const ByteView& file, const HairHeader& header) {
  if (header.has(kSegmentsBit) && !file.has(kHeaderBytes, header.strand_count, sizeof(uint16_t)))
    return make_error(ErrorCode::BadInput, "the file ends before its first point");
  std::vector<uint32_t> offset{0};
  offset.reserve(header.strand_count + size_t{1});
  uint64_t total = 0;
  for (uint32_t strand = 0; strand < header.strand_count; ++strand) {
    const uint32_t segments = header.has(kSegmentsBit)
                                  ? file.get<uint16_t>(kHeaderBytes + strand * sizeof(uint16_t))
                                  : header.default_segments;
    if (segments >= kMaxSourceVertexCount) {
      return make_error(ErrorCode::BadInput, "strand {} has {} segments, at most {} are allowed", strand,
                        segments, kMaxSourceVertexCount - 1);
    }
    total += segments + 1;
    offset.push_back(static_cast<uint32_t>(total));
  }
  return offset;
}

}  // namespace

Result<StatedGroom> read_hair(const ByteView& file) {
  ASSIGN_OR_RETURN(const HairHeader header, read_hair_header(file));
  StatedGroom stated;
  RETURN_IF_ERROR(check_size(file, header, stated.notes));
  Groom& groom = stated.groom;
  ASSIGN_OR_RETURN(groom.offset, read_offsets(file, header));
  const uint64_t segments_bytes = header.has(kSegmentsBit) ? header.strand_count * sizeof(uint16_t) : 0;
  const uint64_t points_at = kHeaderBytes + segments_bytes;
  for (uint32_t i = 0; i < header.point_count && file.has(points_at, i + uint64_t{1}, kPointBytes); ++i) {
    glm::vec3& point = groom.rest_position_m.emplace_back();
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] =
          file.get<float>(points_at + i * kPointBytes + static_cast<uint64_t>(axis) * sizeof(float));
    }
  }
  RETURN_IF_ERROR(fit_points(groom.rest_position_m, groom.offset.back(), "the strands", stated.notes));
  groom = with_pinning(std::move(groom), Pinning::Root);
  return stated;
}

Result<StatedGroom> load_hair(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, load_file(path, kMaxGroomFileBytes));
  auto stated = read_hair(ByteView(bytes));
  if (!stated) return at(path.string(), stated.error());
  stated->groom.name = path.stem().string();
  return stated;
}

}  // namespace strandcast
