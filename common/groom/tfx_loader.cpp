#include "common/groom/tfx_loader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/base/file.h"
#include "common/base/mercy.h"
#include "common/groom/text_scan.h"
#include "common/groom/usable_strands.h"

namespace strandcast {
namespace {

constexpr uint64_t kFloatBytes = sizeof(float);
constexpr std::string_view kTextMark = "version";

/// An array that the header points to. An offset of 0 means that it is absent.
struct TfxArray {
  const char* name;
  uint64_t offset;
  uint64_t count;  // items
  uint64_t item_bytes;
  uint64_t end() const { return offset + count * item_bytes; }
};

struct TfxHeader {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;  // per strand
  uint64_t header_bytes = 0;
  uint64_t position_bytes = 0;  // per vertex
  bool has_both_ends = false;
  bool has_pin_flags = false;
  std::vector<TfxArray> arrays;  // positions first, strand coordinates second

  uint64_t vertex_total() const { return uint64_t{strand_count} * vertex_count; }
  const TfxArray& positions() const { return arrays[0]; }
  const TfxArray& strand_uv() const { return arrays[1]; }
  size_t guide_flags = 0;  // in `arrays`; 0: there are none
};

Status check_counts(uint32_t strand_count, uint32_t vertex_count) {
  if (strand_count == 0) return make_error(ErrorCode::BadInput, "0 strands");
  if (strand_count > kMaxStrandCount) {
    return make_error(ErrorCode::LimitExceeded, "{} strands, at most {} are allowed: export fewer of them",
                      strand_count, kMaxStrandCount);
  }
  if (vertex_count < kMinVertexCount || vertex_count > kMaxSourceVertexCount) {
    return make_error(ErrorCode::BadInput, "{} vertices per strand, allowed are {} to {}", vertex_count,
                      kMinVertexCount, kMaxSourceVertexCount);
  }
  const uint64_t total = uint64_t{strand_count} * vertex_count;
  if (total > kMaxGroomVertices) {
    return make_error(ErrorCode::LimitExceeded, "{} strands x {} vertices, at most {} vertices are allowed",
                      strand_count, vertex_count, kMaxGroomVertices);
  }
  return {};
}

/// Every array lies behind the header and inside the file, no two overlap, and nothing is left over: where a
/// tenth of the bytes at most is missing or too many, a note counts them.
Status check_arrays(const ByteView& file, const TfxHeader& header, std::vector<std::string>& notes) {
  BadItems cut;
  std::vector<TfxArray> arrays;
  for (const TfxArray& array : header.arrays) {
    if (array.offset != 0) arrays.push_back(array);
  }
  std::sort(arrays.begin(), arrays.end(), [](const auto& a, const auto& b) { return a.offset < b.offset; });
  uint64_t end = header.header_bytes;
  for (const TfxArray& array : arrays) {
    if (array.offset < end) {
      return make_error(ErrorCode::BadInput, "offset {} of the {} overlaps what ends at byte {}",
                        array.offset, array.name, end);
    }
    if (array.end() > file.size_bytes()) {
      Error unfit =
          make_error(ErrorCode::BadInput, "{} x {} bytes of {} at offset {} do not fit into {} bytes",
                     array.count, array.item_bytes, array.name, array.offset, file.size_bytes());
      if (array.offset % kFloatBytes != 0) return unfit;  // a wrong offset, and no cut
      cut.add(std::move(unfit), array.end() - std::max(end, file.size_bytes()));
      RETURN_IF_ERROR(cut.judge(array.end(), "bytes"));
    }
    end = array.end();
  }
  RETURN_IF_ERROR(cut.settle(end, "bytes", "since the file is cut off", notes));
  if (end >= file.size_bytes()) return {};
  BadItems left;
  left.add(make_error(ErrorCode::BadInput, "{} bytes are left after the last array, which ends at byte {}",
                      file.size_bytes() - end, end),
           file.size_bytes() - end);
  return left.settle(file.size_bytes(), "bytes", "and are left out", notes);
}

Result<TfxHeader> read_header_v4(const ByteView& file) {
  TfxHeader header;
  header.header_bytes = 160;
  if (!file.has(0, header.header_bytes, 1)) {
    return make_error(ErrorCode::BadInput, "{} bytes, a version 4 header alone has {}", file.size_bytes(),
                      header.header_bytes);
  }
  header.strand_count = file.get<uint32_t>(4);
  header.vertex_count = file.get<uint32_t>(8);
  RETURN_IF_ERROR(check_counts(header.strand_count, header.vertex_count));
  header.position_bytes = 4 * kFloatBytes;
  header.has_pin_flags = true;
  const uint64_t strands = header.strand_count, vertices = header.vertex_total();
  header.arrays = {{"vertex positions", file.get<uint32_t>(12), vertices, header.position_bytes},
                   {"strand coordinates", file.get<uint32_t>(16), strands, 2 * kFloatBytes},
                   {"vertex coordinates", file.get<uint32_t>(20), vertices, 2 * kFloatBytes},
                   {"strand thickness", file.get<uint32_t>(24), strands, kFloatBytes},
                   {"vertex colours", file.get<uint32_t>(28), vertices, 4 * kFloatBytes}};
  return header;
}

Result<TfxHeader> read_header_v3(const ByteView& file) {
  TfxHeader header;
  header.header_bytes = 296;
  if (!file.has(0, header.header_bytes, 1)) {
    return make_error(ErrorCode::BadInput, "{} bytes, a version 3 header alone has {}", file.size_bytes(),
                      header.header_bytes);
  }
  header.strand_count = file.get<uint32_t>(4);
  header.vertex_count = file.get<uint32_t>(8);
  RETURN_IF_ERROR(check_counts(header.strand_count, header.vertex_count));
  const auto both_ends = file.get<int32_t>(16);
  if (both_ends != 0 && both_ends != 1) {
    return make_error(ErrorCode::BadInput, "the both-ends flag is {}, allowed are 0 and 1", both_ends);
  }
  header.has_both_ends = both_ends == 1;
  header.position_bytes = 3 * kFloatBytes;
  const uint64_t strands = header.strand_count, vertices = header.vertex_total();
  header.arrays = {{"vertex positions", file.get<uint32_t>(144), vertices, header.position_bytes},
                   {"strand coordinates", file.get<uint32_t>(152), strands, 2 * kFloatBytes},
                   {"strand thickness", file.get<uint32_t>(148), strands, kFloatBytes},
                   {"vertex colours", file.get<uint32_t>(156), vertices, 4 * kFloatBytes},
                   {"guide flags", file.get<uint32_t>(160), strands, sizeof(uint32_t)},
                   {"vertex coordinates", file.get<uint32_t>(164), vertices, 2 * kFloatBytes}};
  constexpr size_t kGuideFlags = 4;
  if (header.arrays[kGuideFlags].offset != 0) header.guide_flags = kGuideFlags;
  return header;
}

Result<TfxHeader> read_tfx_header(const ByteView& file) {
  if (!file.has(0, 1, kFloatBytes)) {
    return make_error(ErrorCode::BadInput, "{} bytes are too few for a .tfx file", file.size_bytes());
  }
  const auto version = file.get<float>(0);
  if (version >= 4.0f && version < 5.0f) return read_header_v4(file);
  if (version >= 3.0f && version < 4.0f) return read_header_v3(file);
  return make_error(
      ErrorCode::BadInput,
      "the first four bytes give version {}, known are 4 and 3 (binary) and text that begins with "
      "'version 2.0'",
      version);
}

/// Points as far as the file has them.
void read_positions(const ByteView& file, const TfxHeader& header, Groom& groom) {
  groom.rest_position_m.resize(header.vertex_total());
  for (uint64_t i = 0; i < header.vertex_total(); ++i) {
    const uint64_t offset = header.positions().offset + i * header.position_bytes;
    if (!file.has(offset, 1, header.position_bytes)) {
      groom.rest_position_m.resize(i);
      return;
    }
    for (int axis = 0; axis < 3; ++axis) {
      groom.rest_position_m[i][axis] = file.get<float>(offset + static_cast<uint64_t>(axis) * kFloatBytes);
    }
  }
}

/// Pin flags of version 4: the fourth float is an inverse mass, 0 = pinned. One that is no mass holds
/// nothing, but for a root, and notes count these.
Status read_pins(const ByteView& file, const TfxHeader& header, Groom& groom,
                 std::vector<std::string>& notes) {
  BadItems broken;
  groom.pinned.resize(header.vertex_total());
  for (uint64_t i = 0; i < header.vertex_total(); ++i) {
    const uint64_t offset = header.positions().offset + i * header.position_bytes + 3 * kFloatBytes;
    const float inverse_mass = file.has(offset, 1, kFloatBytes) ? file.get<float>(offset) : 1.0f;
    const uint64_t strand = i / header.vertex_count, vertex = i % header.vertex_count;
    if (!std::isfinite(inverse_mass) || inverse_mass < 0.0f)
      broken.add(make_error(ErrorCode::BadInput,
                            "strand {} vertex {} (byte {}) has the inverse mass {}, allowed is 0 or more",
                            strand, vertex, offset, inverse_mass));
    groom.pinned[i] = vertex == 0 || inverse_mass == 0.0f ? 1 : 0;
  }
  return broken.settle(header.vertex_total(), "vertices", "so that these are free", notes);
}

void read_root_uv(const ByteView& file, const TfxHeader& header, Groom& groom) {
  if (header.strand_uv().offset == 0) return;
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();  // where the file is cut off
  groom.root_uv.resize(header.strand_count, glm::vec2(kNone));
  for (uint64_t i = 0; i < header.strand_count; ++i) {
    const uint64_t offset = header.strand_uv().offset + i * header.strand_uv().item_bytes;
    if (!file.has(offset, 1, header.strand_uv().item_bytes)) return;
    groom.root_uv[i] = {file.get<float>(offset), file.get<float>(offset + kFloatBytes)};
  }
}

/// Which strands are guides, none where the file does not say it.
std::vector<uint8_t> read_guides(const ByteView& file, const TfxHeader& header) {
  std::vector<uint8_t> is_guide;
  if (header.guide_flags == 0) return is_guide;
  const TfxArray& flags = header.arrays[header.guide_flags];
  for (uint64_t i = 0; i < flags.count && file.has(flags.offset + i * flags.item_bytes, 1, flags.item_bytes);
       ++i)
    is_guide.push_back(file.get<uint32_t>(flags.offset + i * flags.item_bytes) != 0 ? 1 : 0);
  is_guide.resize(flags.count, 0);
  return is_guide;
}

}  // namespace

Result<StatedGroom> read_tfx_binary(const ByteView& file, GuideUse guides) {
  ASSIGN_OR_RETURN(const TfxHeader header, read_tfx_header(file));
  if (header.positions().offset == 0) {
    return make_error(ErrorCode::BadInput,
                      "the offset of the vertex positions is 0, they start at {} or later",
                      header.header_bytes);
  }
  StatedGroom stated;
  RETURN_IF_ERROR(check_arrays(file, header, stated.notes));
  Groom& groom = stated.groom;
  groom.offset.resize(header.strand_count + size_t{1});
  for (uint32_t strand = 0; strand <= header.strand_count; ++strand) {
    groom.offset[strand] = strand * header.vertex_count;
  }
  read_positions(file, header, groom);
  RETURN_IF_ERROR(fit_points(groom.rest_position_m, header.vertex_total(), "the strands", stated.notes));
  read_root_uv(file, header, groom);
  if (header.has_pin_flags) {
    RETURN_IF_ERROR(read_pins(file, header, groom, stated.notes));
    return stated;
  }
  add_note(stated.notes, part_guides(groom, stated.labels, read_guides(file, header), guides));
  groom = with_pinning(std::move(groom), header.has_both_ends ? Pinning::BothEnds : Pinning::RootPair);
  return stated;
}

Result<StatedGroom> load_tfx(const std::filesystem::path& path, GuideUse guides) {
  ASSIGN_OR_RETURN(const std::string bytes, load_text(path, kMaxGroomFileBytes));
  const std::string_view text = without_byte_order_mark(bytes);
  auto stated = text.starts_with(kTextMark)
                    ? read_tfx_text(text)
                    : read_tfx_binary(ByteView(std::as_bytes(std::span(bytes))), guides);
  if (!stated) return at(path.string(), stated.error());
  stated->groom.name = path.stem().string();
  return stated;
}

}  // namespace strandcast
