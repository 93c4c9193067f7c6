// libFuzzer entry: the payload of an Asset message, and what a viewer does with a small one.
#include "common/base/check.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_codec.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::scene_asset_fuzz {

extern "C" int FUZZ_ENTRY(scene_asset)(const uint8_t* data, size_t size) {
  const auto asset = decode_scene_asset(FuzzInput(data, size).take_rest());
  if (!asset) return 0;
  CHECK(asset->rest_position_m.size() == static_cast<size_t>(asset->strand_count) * asset->vertex_count);
  for (const RootTriangle& triangle : asset->triangle)
    for (int i = 0; i < 3; ++i) CHECK(triangle[i] < asset->strand_count);
  for (const glm::uvec3& triangle : asset->head.triangle)
    for (int i = 0; i < 3; ++i) CHECK(triangle[i] < asset->head.position_m.size());
  const auto again = decode_scene_asset(encode_scene_asset(*asset));
  CHECK(again.ok() && again->rest_position_m == asset->rest_position_m);
  CHECK(again->triangle == asset->triangle && again->head.triangle == asset->head.triangle);

  constexpr size_t kManyVertices = 20'000;  // more only cost time here
  if (asset->rest_position_m.size() > kManyVertices) return 0;
  auto decoder = make_strand_decoder("tangent", {asset->strand_count, asset->vertex_count});
  CHECK(decoder.ok());
  (*decoder)->set_rest_shape(asset->rest_position_m);
  return 0;
}

}  // namespace strandcast::scene_asset_fuzz
