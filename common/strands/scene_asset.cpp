#include "common/strands/scene_asset.h"

#include <cmath>

#include "common/base/check.h"
#include "common/strands/byte_io.h"
#include "common/strands/zstd_block.h"

namespace strandcast {
namespace {

constexpr uint32_t kAssetLayout = 1;
constexpr int kAssetLevel = 3;

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

}  // namespace

std::vector<std::byte> encode_scene_asset(const SceneAsset& asset) {
  AssetCounts counts;
  counts.strands = asset.strand_count;
  counts.vertices = asset.vertex_count;
  counts.triangles = static_cast<uint32_t>(asset.triangle.size());
  counts.mesh_vertices = static_cast<uint32_t>(asset.head.position_m.size());
  counts.mesh_triangles = static_cast<uint32_t>(asset.head.triangle.size());
  CHECK(asset.head.normal.size() == asset.head.position_m.size());

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
  ByteWriter writer(payload);
  for (const uint32_t number : {kAssetLayout, counts.strands, counts.vertices, counts.triangles,
                                counts.mesh_vertices, counts.mesh_triangles})
    writer.put(number);
  ZstdCompressor().append(content, kAssetLevel, payload);
  return payload;
}

Result<SceneAsset> decode_scene_asset(std::span<const std::byte> payload) {
  ByteReader reader(payload);
  const auto layout = reader.take<uint32_t>();
  AssetCounts counts;
  counts.strands = reader.take<uint32_t>();
  counts.vertices = reader.take<uint32_t>();
  counts.triangles = reader.take<uint32_t>();
  counts.mesh_vertices = reader.take<uint32_t>();
  counts.mesh_triangles = reader.take<uint32_t>();
  if (!reader.ok())
    return make_error(ErrorCode::BadInput, "asset of {} bytes is too short for its counts", payload.size());
  if (layout != kAssetLayout)
    return make_error(ErrorCode::BadInput, "asset has layout {}, known is {}", layout, kAssetLayout);
  RETURN_IF_ERROR(check(counts));
  // Before anything is allocated: does the compressed part promise exactly what the counts need?
  ASSIGN_OR_RETURN(const size_t declared_bytes, zstd_content_bytes(reader.rest(), counts.content_bytes()));
  if (declared_bytes != counts.content_bytes())
    return make_error(ErrorCode::BadInput, "asset declares {} bytes, its counts need {}", declared_bytes,
                      counts.content_bytes());
  std::vector<std::byte> content(counts.content_bytes());
  RETURN_IF_ERROR(ZstdDecompressor().fill(reader.rest(), content));

  ByteReader items(content);
  SceneAsset asset;
  asset.strand_count = counts.strands;
  asset.vertex_count = counts.vertices;
  asset.rest_position_m = take_items<glm::vec3>(items, static_cast<size_t>(counts.strands) * counts.vertices);
  asset.triangle = take_items<RootTriangle>(items, counts.triangles);
  asset.head.position_m = take_items<glm::vec3>(items, counts.mesh_vertices);
  asset.head.normal = take_items<glm::vec3>(items, counts.mesh_vertices);
  asset.head.triangle = take_items<glm::uvec3>(items, counts.mesh_triangles);

  constexpr float kMaxNormal = 1.001f;  // unit length, rounded
  RETURN_IF_ERROR(check_points("rest position", asset.rest_position_m, kMaxGroomExtentM));
  RETURN_IF_ERROR(check_indices("root triangle", asset.triangle, counts.strands));
  RETURN_IF_ERROR(check_points("mesh vertex", asset.head.position_m, kMaxGroomExtentM));
  RETURN_IF_ERROR(check_points("mesh normal", asset.head.normal, kMaxNormal));
  RETURN_IF_ERROR(check_indices("mesh triangle", asset.head.triangle, counts.mesh_vertices));
  return asset;
}

}  // namespace strandcast
