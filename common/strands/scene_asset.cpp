#include "common/strands/scene_asset.h"

#include <cmath>

#include "common/base/check.h"
#include "common/strands/asset/form.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/asset/layout.h"
#include "common/strands/asset/strands.h"
#include "common/strands/asset/triangles.h"
#include "common/strands/byte_io.h"
#include "common/strands/zstd_block.h"

namespace strandcast {
namespace {

constexpr int kAssetLevel = 3;
/// Parts of the layouts Numbers and Form, in their order; the head is one of the last two.
enum class Part : uint8_t { Strands = 1, Triangles = 2, Head = 3, Form = 4 };
enum class HeadRead { Whole, LeftOut };

static_assert(sizeof(glm::vec3) == 12 && sizeof(glm::uvec3) == 12, "copied as they lie in memory");
constexpr size_t kItemBytes = 12;

/// The numbers in front of the compressed part.
struct AssetCounts {
  uint32_t strands = 0;
  uint32_t vertices = 0;  // per strand
  uint32_t triangles = 0;
  uint32_t mesh_vertices = 0;
  uint32_t mesh_triangles = 0;

  size_t content_bytes() const {
    const size_t items =
        static_cast<size_t>(strands) * vertices + triangles + 2 * size_t{mesh_vertices} + mesh_triangles;
    return kItemBytes * items;
  }
};

Status check_range(const char* what, uint64_t value, uint64_t low, uint64_t high) {
  if (value >= low && value <= high) return {};
  return make_error(ErrorCode::LimitExceeded, "asset has {} {}, allowed are {}..{}", value, what, low, high);
}

Status check(const AssetCounts& counts) {
  RETURN_IF_ERROR(check_range("strands", counts.strands, 1, kMaxStrandCount));
  RETURN_IF_ERROR(check_range("vertices per strand", counts.vertices, kMinVertexCount, kMaxVertexCount));
  RETURN_IF_ERROR(check_range("vertices", uint64_t{counts.strands} * counts.vertices, 1, kMaxGroomVertices));
  RETURN_IF_ERROR(
      check_range("root triangles", counts.triangles, 0, uint64_t{counts.strands} * kMaxTrianglesPerStrand));
  RETURN_IF_ERROR(check_range("mesh vertices", counts.mesh_vertices, 0, kMaxMeshVertices));
  return check_range("mesh triangles", counts.mesh_triangles, 0, kMaxMeshTriangles);
}

template <class T>
std::vector<T> take_items(ByteReader& reader, size_t count) {
  std::vector<T> items(count);
  const auto source = reader.take_bytes(count * sizeof(T));
  CHECK(source.size() == count * sizeof(T));  // the content size was checked
  if (count > 0) std::memcpy(items.data(), source.data(), source.size());
  return items;
}

Status check_points(const char* what, const std::vector<glm::vec3>& points, float extent) {
  for (size_t i = 0; i < points.size(); ++i) {
    const glm::vec3& point = points[i];
    const bool is_inside =
        std::abs(point.x) <= extent && std::abs(point.y) <= extent && std::abs(point.z) <= extent;
    if (!is_inside)  // also when not a number
      return make_error(ErrorCode::BadInput, "{} {} is ({}, {}, {}), allowed is +-{}", what, i, point.x,
                        point.y, point.z, extent);
  }
  return {};
}

Status check_indices(const char* what, const std::vector<glm::uvec3>& triangles, uint32_t count) {
  for (size_t i = 0; i < triangles.size(); ++i) {
    const glm::uvec3& triangle = triangles[i];
    if (triangle.x >= count || triangle.y >= count || triangle.z >= count)
      return make_error(ErrorCode::BadInput, "{} {} is ({}, {}, {}), but there are only {}", what, i,
                        triangle.x, triangle.y, triangle.z, count);
  }
  return {};
}

AssetCounts counts_of(const SceneAsset& asset) {
  CHECK(asset.head.normal.size() == asset.head.position_m.size());
  return {asset.strand_count, asset.vertex_count, static_cast<uint32_t>(asset.triangle.size()),
          static_cast<uint32_t>(asset.head.position_m.size()),
          static_cast<uint32_t>(asset.head.triangle.size())};
}

void put_counts(AssetLayout layout, const AssetCounts& counts, std::vector<std::byte>& payload) {
  ByteWriter writer(payload);
  for (const uint32_t number : {static_cast<uint32_t>(layout), counts.strands, counts.vertices,
                                counts.triangles, counts.mesh_vertices, counts.mesh_triangles})
    writer.put(number);
}

std::vector<std::byte> encode_floats(const SceneAsset& asset, const AssetCounts& counts) {
  std::vector<std::byte> content;
  content.reserve(counts.content_bytes());
  ByteWriter content_writer(content);
  content_writer.put_bytes(std::as_bytes(std::span(asset.rest_position_m)));
  content_writer.put_bytes(std::as_bytes(std::span(asset.triangle)));
  content_writer.put_bytes(std::as_bytes(std::span(asset.head.position_m)));
  content_writer.put_bytes(std::as_bytes(std::span(asset.head.normal)));
  content_writer.put_bytes(std::as_bytes(std::span(asset.head.triangle)));
  CHECK(content.size() == counts.content_bytes());
  std::vector<std::byte> payload;
  put_counts(AssetLayout::Floats, counts, payload);
  ZstdCompressor().append(content, kAssetLevel, payload);
  return payload;
}

/// Moves points between the order of an asset, strand fastest, and strands one after the other.
template <class Point>
std::vector<Point> turned(const std::vector<Point>& points, size_t row_count, size_t column_count) {
  std::vector<Point> result(points.size());
  for (size_t row = 0; row < row_count; ++row)
    for (size_t column = 0; column < column_count; ++column)
      result[column * row_count + row] = points[row * column_count + column];
  return result;
}

void put_part(Part part, const std::vector<std::byte>& body, std::vector<std::byte>& payload) {
  ByteWriter writer(payload);
  writer.put(static_cast<uint8_t>(part));
  writer.put(static_cast<uint32_t>(body.size()));
  writer.put_bytes(body);
}

/// Returns nothing where the asset cannot be told by numbers.
std::vector<std::byte> encode_numbers(const SceneAsset& asset, const AssetCounts& counts,
                                      AssetLayout newest) {
  if (!check(counts) || !check_indices("", asset.triangle, counts.strands) ||
      !check_indices("", asset.head.triangle, counts.mesh_vertices) ||
      (asset.head.triangle.empty() && !asset.head.position_m.empty()))
    return {};
  auto points = asset::to_lattice(asset.rest_position_m);
  if (!points) return {};
  points->point = turned(points->point, counts.vertices, counts.strands);
  std::vector<std::byte> payload, body, form;
  const bool has_form = newest >= AssetLayout::Form && asset::append_form(asset.head, form);
  put_counts(has_form ? AssetLayout::Form : AssetLayout::Numbers, counts, payload);
  asset::append_strands({counts.strands, counts.vertices, std::move(*points)}, body);
  put_part(Part::Strands, body, payload);
  body.clear();
  asset::append_triangles(asset.triangle, std::span(asset.rest_position_m).first(counts.strands), body);
  put_part(Part::Triangles, body, payload);
  if (asset.head.triangle.empty()) return payload;
  if (has_form) {
    put_part(Part::Form, form, payload);
    return payload;
  }
  body.clear();
  if (!asset::append_head(asset.head, body)) return {};
  put_part(Part::Head, body, payload);
  return payload;
}

Result<SceneAsset> decode_floats(std::span<const std::byte> source, const AssetCounts& counts) {
  // Before anything is allocated: does the compressed part promise exactly what the counts need?
  ASSIGN_OR_RETURN(const size_t declared_bytes, zstd_content_bytes(source, counts.content_bytes()));
  if (declared_bytes != counts.content_bytes())
    return make_error(ErrorCode::BadInput, "asset declares {} bytes, its counts need {}", declared_bytes,
                      counts.content_bytes());
  std::vector<std::byte> content(counts.content_bytes());
  RETURN_IF_ERROR(ZstdDecompressor().fill(source, content));
  ByteReader items(content);
  SceneAsset asset;
  asset.rest_position_m = take_items<glm::vec3>(items, static_cast<size_t>(counts.strands) * counts.vertices);
  asset.triangle = take_items<RootTriangle>(items, counts.triangles);
  asset.head.position_m = take_items<glm::vec3>(items, counts.mesh_vertices);
  asset.head.normal = take_items<glm::vec3>(items, counts.mesh_vertices);
  asset.head.triangle = take_items<glm::uvec3>(items, counts.mesh_triangles);
  return asset;
}

Result<std::span<const std::byte>> take_part(Part part, ByteReader& reader) {
  const auto kind = reader.take<uint8_t>();
  const auto body = reader.take_bytes(reader.take<uint32_t>());
  if (reader.ok() && kind == static_cast<uint8_t>(part)) return body;
  return make_error(ErrorCode::BadInput, "asset has no whole part {} where it has to be",
                    static_cast<int>(part));
}

Result<SceneAsset> decode_numbers(std::span<const std::byte> source, const AssetCounts& counts,
                                  AssetLayout layout, HeadRead head_read) {
  ByteReader reader(source);
  SceneAsset asset;
  asset::StrandShape shape{counts.strands, counts.vertices, {}};
  ASSIGN_OR_RETURN(const auto strands, take_part(Part::Strands, reader));
  RETURN_IF_ERROR(asset::read_strands(strands, shape));
  asset.rest_position_m = turned(asset::to_metres(shape.points), counts.strands, counts.vertices);
  ASSIGN_OR_RETURN(const auto triangles, take_part(Part::Triangles, reader));
  asset.triangle.resize(counts.triangles);
  const auto roots_m = std::span(asset.rest_position_m).first(counts.strands);
  RETURN_IF_ERROR(asset::read_triangles(triangles, roots_m, asset.triangle));
  if (head_read == HeadRead::LeftOut) return asset;
  if (counts.mesh_triangles > 0) {
    const asset::HeadCounts head_counts{counts.mesh_vertices, counts.mesh_triangles};
    const bool is_form = layout == AssetLayout::Form;
    ASSIGN_OR_RETURN(const auto head, take_part(is_form ? Part::Form : Part::Head, reader));
    RETURN_IF_ERROR(is_form ? asset::read_form(head, head_counts, asset.head)
                            : asset::read_head(head, head_counts, asset.head));
  }
  if (!reader.rest().empty() || asset.head.position_m.size() != counts.mesh_vertices)
    return make_error(ErrorCode::BadInput, "asset goes on for {} bytes, or lacks a mesh of {} vertices",
                      reader.rest().size(), counts.mesh_vertices);
  return asset;
}

Result<SceneAsset> decode_asset(std::span<const std::byte> payload, HeadRead head_read) {
  ByteReader reader(payload);
  const auto layout = static_cast<AssetLayout>(reader.take<uint32_t>());
  AssetCounts counts;
  counts.strands = reader.take<uint32_t>();
  counts.vertices = reader.take<uint32_t>();
  counts.triangles = reader.take<uint32_t>();
  counts.mesh_vertices = reader.take<uint32_t>();
  counts.mesh_triangles = reader.take<uint32_t>();
  if (!reader.ok())
    return make_error(ErrorCode::BadInput, "asset of {} bytes is too short for its counts", payload.size());
  if (layout < AssetLayout::Floats || layout > kNewestAssetLayout)
    return make_error(ErrorCode::BadInput, "asset has layout {}, known are 1 to {}",
                      static_cast<uint32_t>(layout), static_cast<uint32_t>(kNewestAssetLayout));
  RETURN_IF_ERROR(check(counts));
  ASSIGN_OR_RETURN(SceneAsset asset, layout == AssetLayout::Floats
                                         ? decode_floats(reader.rest(), counts)
                                         : decode_numbers(reader.rest(), counts, layout, head_read));
  if (head_read == HeadRead::LeftOut) asset.head = {};
  asset.strand_count = counts.strands;
  asset.vertex_count = counts.vertices;

  constexpr float kMaxNormal = 1.001f;  // unit length, rounded
  RETURN_IF_ERROR(check_points("rest position", asset.rest_position_m, kMaxGroomExtentM));
  RETURN_IF_ERROR(check_indices("root triangle", asset.triangle, counts.strands));
  RETURN_IF_ERROR(check_points("mesh vertex", asset.head.position_m, kMaxGroomExtentM));
  RETURN_IF_ERROR(check_points("mesh normal", asset.head.normal, kMaxNormal));
  RETURN_IF_ERROR(check_indices("mesh triangle", asset.head.triangle, counts.mesh_vertices));
  return asset;
}

}  // namespace

AssetLayout newest_asset_layout() {
  return asset::makes_other_heads() ? AssetLayout::Numbers : kNewestAssetLayout;
}

std::vector<std::byte> encode_scene_asset(const SceneAsset& asset, AssetLayout newest) {
  const AssetCounts counts = counts_of(asset);
  std::vector<std::byte> payload;
  if (newest >= AssetLayout::Numbers) payload = encode_numbers(asset, counts, newest);
  return payload.empty() ? encode_floats(asset, counts) : payload;
}

std::vector<std::byte> encode_scene_asset(const SceneAsset& asset) {
  return encode_scene_asset(asset, kNewestAssetLayout);
}

Result<SceneAsset> decode_scene_asset(std::span<const std::byte> payload) {
  return decode_asset(payload, HeadRead::Whole);
}

Result<SceneAsset> decode_asset_strands(std::span<const std::byte> payload) {
  return decode_asset(payload, HeadRead::LeftOut);
}

}  // namespace strandcast
