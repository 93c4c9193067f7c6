// What a scene is without is not seen, and what is simulated less is not seen from where it is.
#include "server/report/pruning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/groom/groom_asset.h"
#include "common/render/hair_size.h"
#include "common/render/render_device.h"
#include "server/report/scene_run.h"
#include "server/source/sim_detail.h"
#include "tests/support/sim_devices.h"
#include "tests/support/test_grid.h"

namespace strandcast::pruning_test {
namespace {

SceneDesc few_strands(SceneDesc scene, uint32_t strand_count) {
  ProceduralGroomDesc groom;
  groom.strand_count = strand_count;
  groom.vertex_count = 8;
  scene.groom = groom;
  return scene;
}

SceneDesc bare_scene() {
  SceneDesc scene = few_strands({}, 60);
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = 180.0;
  return scene;
}

class Pruning : public testing::TestWithParam<SimDevice> {
 protected:
  Executor& executor() { return executors_.on(GetParam()); }
  SimExecutors executors_;
};

INSTANTIATE_TEST_SUITE_P(Devices, Pruning, testing::ValuesIn(sim_devices()), name_of_device);

// Every strand model with a kernel: with a pass that nobody asked for hair is where it is without, bit for
// bit. Pictures of the same bits are the same: on the small grid of the first model.
TEST_P(Pruning, WhatIsLeftOutIsNotMissed) {
  for (const char* solver : {"dftl", "direct_rod", "xpbd"}) {
    PruningDesc desc;
    desc.scene = bare_scene();
    desc.scene.solver.name = solver;
    desc.motion = built_in_stream_motions()[1];
    desc.steps = 20;
    desc.has_pictures = GetParam() == SimDevice::Lanes &&
                        (desc.scene.solver.name == "dftl" || test_grid() == TestGrid::Whole);
    const auto run = run_pruning(desc, executor());
    ASSERT_TRUE(run.ok()) << run.error().to_string();
    EXPECT_EQ(run->passes.size(), 7u) << "all that a step can be without";
    EXPECT_THAT(pruning_breaks({*run}), testing::IsEmpty()) << solver;
    size_t forced = 0;
    for (const PrunedPass& pass : run->passes) {
      if (!pass.note.empty()) continue;
      ++forced;
      if (GetParam() == SimDevice::Lanes) {
        EXPECT_TRUE(pass.is_same_hair) << pass.pass;
      }
      EXPECT_GE(pass.with_bytes, pass.without_bytes) << pass.pass;
      EXPECT_GT(pass.without_ms, 0.0) << pass.pass;
    }
    EXPECT_EQ(forced, 6u);
    EXPECT_EQ(run->reader_passes.empty(), !desc.has_pictures);
  }
}

TEST(PruningReport, SaysWhatIsSeen) {
  PrunedPass pass;
  pass.pass = "scene/wind";
  pass.is_same_hair = true;
  pass.has_pictures = pass.is_same_picture = true;
  PruningRun run{"walk", {pass}, {}, true};
  EXPECT_TRUE(pruning_breaks({run}).empty());
  run.passes[0].is_same_hair = false;
  run.passes[0].largest_mm = 0.5 * kRoundingMm;
  EXPECT_TRUE(pruning_breaks({run}).empty());
  run.passes[0].largest_mm = 2.0 * kRoundingMm;
  EXPECT_THAT(pruning_breaks({run}), testing::ElementsAre(testing::HasSubstr("scene/wind")));
  EXPECT_THAT(pruning_text({run}, {}), testing::HasSubstr("0.0200 mm"));
  EXPECT_THAT(pruning_csv({run}), testing::HasSubstr("walk,scene/wind"));
  run.passes[0].is_same_hair = true;
  run.passes[0].largest_mm = 0.0;
  run.passes[0].is_same_picture = false;
  run.is_same_unread = false;
  EXPECT_EQ(pruning_breaks({run}).size(), 2u);
  run.passes[0].note = "nothing to load";
  EXPECT_EQ(pruning_breaks({run}).size(), 1u);
  EXPECT_THAT(pruning_page({run}, {}), testing::HasSubstr("walk"));
}

// At the size from which fewer strands are simulated, a person cannot tell.
TEST(DetailPictures, FewerStrandsAreNotSeenFromWhereTheyAreFewer) {
  constexpr double kLeastPsnrDb = 40.0;
  constexpr RenderSize kSize{320, 240};
  SceneDesc scene = few_strands(built_in_scene(), 600);
  scene.detail.mode = kDetailAuto;
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  const SceneAsset asset = make_scene_asset(content->groom, content->head);
  SimExecutors executors;
  Executor& lanes = executors.on(SimDevice::Lanes);
  const RuntimeFacts fewer{.detail = DetailLevel::FewerStrands, .detail_reason = "far"};
  const auto all = SceneRun::make(scene, *content, {}, lanes);
  const auto some = SceneRun::make(scene, *content, fewer, lanes);
  ASSERT_TRUE(all.ok() && some.ok());
  const StreamMotion motion = built_in_stream_motions()[1];
  for (int step = 1; step <= 90; ++step) {
    ASSERT_TRUE((*all)->step(motion.head_at(step / 60.0)).ok());
    ASSERT_TRUE((*some)->step(motion.head_at(step / 60.0)).ok());
  }
  const auto truth = (*all)->publish(), guess = (*some)->publish();
  ASSERT_TRUE(truth.ok() && guess.ok());
  EXPECT_NE(state_hash(**truth), state_hash(**guess));

  const auto device = RenderDevice::open({"tiles", "auto", {}});
  ASSERT_TRUE(device.ok());
  const auto renderer = (*device)->make_renderer(asset, scene.look);
  ASSERT_TRUE(renderer.ok());
  // As large as hair may be at that level.
  CameraDesc camera = scene.camera;
  const HairExtent extent = hair_extent(asset);
  while (level_for(scene.detail, hair_height_px(extent, camera, {kSize.width, kSize.height})) <
         DetailLevel::FewerStrands)
    camera.offset_m *= 1.02f;
  const auto draw = [&](const Snapshot& state) {
    EXPECT_TRUE((*renderer)->draw({state.world_from_head, positions_in_head(state)}, camera, kSize).ok());
    return (*renderer)->read_image();
  };
  const Image exact = draw(**truth), less = draw(**guess);
  const auto error = picture_error(less, exact, PictureMask(size_t{kSize.width} * kSize.height, 1));
  ASSERT_TRUE(error.ok());
  RecordProperty("psnr_db", fmt::format("{:.1f}", error->psnr_db));
  EXPECT_GE(error->psnr_db, kLeastPsnrDb);
}

}  // namespace
}  // namespace strandcast::pruning_test
