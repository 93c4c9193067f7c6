#include "tests/conformance/payload_vectors.h"

#include <array>

#include "common/groom/groom.h"
#include "common/pictures/jpeg_tiles.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/head/head_form.h"
#include "tests/conformance/reference_hash.h"
#include "tests/support/sample_asset.h"

namespace strandcast::conformance {
namespace {

std::vector<uint8_t> bytes_of(std::span<const glm::vec3> points) {
  std::vector<uint8_t> part;
  for (const glm::vec3& point : points)
    for (int axis = 0; axis < 3; ++axis) append_number(part, point[axis]);
  return part;
}
std::vector<uint8_t> bytes_of(std::span<const glm::uvec3> triangles) {
  std::vector<uint8_t> part;
  for (const glm::uvec3& triangle : triangles)
    for (int corner = 0; corner < 3; ++corner) append_number(part, triangle[corner]);
  return part;
}

/// All tiles of a picture of one colour, every second one in full chroma.
std::string make_tiles(uint32_t width, uint32_t height, const std::array<uint8_t, 3>& color) {
  Image image{width, height, {}};
  for (uint32_t i = 0; i < width * height; ++i)
    image.rgba.insert(image.rgba.end(), {color[0], color[1], color[2], 255});
  auto encoder = std::move(TileEncoder::make()).value();
  std::vector<CodedTile> coded;
  for (uint32_t index = 0; index < tiles_along(width) * tiles_along(height); ++index)
    coded.push_back(
        encoder.encode(image, index, 95, index % 2 == 0 ? TileChroma::Halved : TileChroma::Full).value());
  std::vector<PlacedTile> placed;
  for (const CodedTile& tile : coded) placed.push_back({static_cast<uint16_t>(placed.size()), &tile});
  return fmt::format("tiles {} {} {} {} {} {}\n", width, height, color[0], color[1], color[2],
                     to_hex(pack_tiles(width, height, placed)));
}

/// A form whose factors all differ; its numbers are whole steps.
HeadForm sample_form() {
  HeadForm form;
  form.center_m = {0.01, -0.02, 0.03};
  form.radius_m = {0.094, 0.1, 0.09};
  form.drop = 0.15;
  for (size_t i = 0; i < form.neck_width.size(); ++i)
    form.neck_width[i] = 0.75 + static_cast<double>(i * i % 97) / 512.0;
  for (size_t i = 0; i < form.pull.size(); ++i)
    form.pull[i] = 0.9375 + static_cast<double>(i * i % 89) / 1024.0;
  return form;
}

}  // namespace

uint64_t content_hash(const SceneAsset& asset) {
  ReferenceHash hash;
  hash.add(bytes_of(asset.rest_position_m));
  hash.add(bytes_of(asset.triangle));
  hash.add(bytes_of(asset.head.position_m));
  hash.add(bytes_of(asset.head.normal));
  hash.add(bytes_of(asset.head.triangle));
  return hash.value();
}

std::string make_asset_lines(AssetLayout layout) {
  std::string lines;
  SceneAsset bare = sample_asset(1, 2);
  bare.head = {};
  std::vector<SceneAsset> assets = {sample_asset(5, 3), bare};
  if (layout ==
      AssetLayout::Numbers) {  // a neighbour's turns, a head with an edge that three triangles share
    assets = {sample_asset(40, 12), bare};
    for (SceneAsset& asset : assets) round_to_lattice(asset.rest_position_m, kRestStepBits);
    Mesh& head = assets[0].head;
    head.position_m.emplace_back(0.0f, -0.1f, 0.05f);
    head.normal.emplace_back(0.6f, -0.8f, 0.0f);
    head.triangle.emplace_back(1, 0, 4);
    head = as_sent(head);
  }
  if (layout == AssetLayout::Form) {  // as it is, and all of it fitted
    assets = {sample_asset(7, 4), sample_asset(6, 3)};
    for (SceneAsset& asset : assets) round_to_lattice(asset.rest_position_m, kRestStepBits);
    assets[0].head = as_sent(make_head(HeadForm()));
    assets[1].head = as_sent(make_head(sample_form()));
  }
  for (const SceneAsset& asset : assets)
    lines +=
        fmt::format("asset {:016x} {}\n", content_hash(asset), to_hex(encode_scene_asset(asset, layout)));
  return lines;
}

std::string make_tile_lines() {
  return make_tiles(70, 130, {200, 120, 40}) + make_tiles(64, 64, {10, 200, 250});
}

}  // namespace strandcast::conformance
