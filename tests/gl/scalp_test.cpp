// What strandcast-report scalp measures: a scalp is all visible when bald, less under hair, and a limit of
// the roots keeps it covered.
#include "server/report/scalp.h"

#include <gtest/gtest.h>

#include "common/groom/groom_asset.h"
#include "common/scene/scene_file.h"
#include "server/scene/scene_content.h"

namespace strandcast::scalp_test {
namespace {

using testing::HasSubstr;

constexpr RenderSize kSize{160, 90};

class Scalp : public testing::Test {
 protected:
  static SceneDesc scene(uint32_t strand_count, double follicle_limit_deg) {
    const auto made = built_in_scene_with({fmt::format("groom.procedural.strand_count={}", strand_count),
                                           "groom.procedural.vertex_count=10",
                                           fmt::format("follicle_limit_deg={}", follicle_limit_deg)});
    EXPECT_TRUE(made) << made.error().to_string();
    return *made;
  }
  static SceneAsset asset_of(const SceneDesc& scene) {
    const auto content = load_scene_content(scene);
    EXPECT_TRUE(content) << content.error().to_string();
    return make_scene_asset(content->groom, content->head);
  }

  std::unique_ptr<Executor> executor_ = open_executor({"gl", "auto", {}}).value();
  gl::DeviceInfo device_ = gl::read_device_info().value();
  gl::ShaderLibrary shaders_;
};

TEST_F(Scalp, IsAllVisibleWithoutHairAndLessTheMoreThereIs) {
  double before = 1.0;
  for (const uint32_t strands : {100u, 400u, 1600u}) {
    const SceneDesc desc = scene(strands, 180.0);
    const SceneAsset asset = asset_of(desc);
    auto view = ScalpView::make(shaders_, device_, asset, desc, kSize);
    ASSERT_TRUE(view) << view.error().to_string();
    std::vector<glm::vec3> gone = asset.rest_position_m;
    for (glm::vec3& point : gone) point.y += 1000.0f;
    const auto bald = view->visible(gone);
    ASSERT_TRUE(bald) << bald.error().to_string();
    for (const double share : *bald) EXPECT_EQ(share, 1.0);
    const auto groomed = view->visible(asset.rest_position_m);
    ASSERT_TRUE(groomed) << groomed.error().to_string();
    EXPECT_LT((*groomed)[2], before) << strands << " strands, from behind";
    before = (*groomed)[2];
  }
  EXPECT_LT(before, 0.5);
}

TEST_F(Scalp, ASceneWithoutAHeadHasNone) {
  SceneDesc desc = scene(100, 20.0);
  desc.head.is_visible = false;
  const auto view = ScalpView::make(shaders_, device_, asset_of(desc), desc, kSize);
  ASSERT_FALSE(view);
  EXPECT_THAT(view.error().to_string(), HasSubstr("head.is_visible"));
}

// In violent turns free roots lay the scalp bare; held ones less.
TEST_F(Scalp, HeldRootsCoverMoreOfIt) {
  ScalpRun runs[2];
  for (const int is_held : {0, 1}) {
    ScalpRunDesc desc;
    desc.scene = scene(800, is_held != 0 ? 20.0 : 180.0);
    desc.motion = built_in_stream_motions()[2];
    desc.seconds = 1.5;
    desc.size = kSize;
    desc.every_s = 0.5;
    auto run = run_scalp(desc, shaders_, device_, *executor_);
    ASSERT_TRUE(run) << run.error().to_string();
    runs[is_held] = std::move(*run);
    fmt::print("{}", scalp_text(desc, runs[is_held]));
    EXPECT_THAT(scalp_csv(runs[is_held]), HasSubstr("time_s,view,visible,groomed,root_p95_deg\n"));
  }
  EXPECT_EQ(runs[0].groomed, runs[1].groomed) << "hair as loaded is the same";
  EXPECT_LT(runs[1].growth_around(), runs[0].growth_around());
  for (const ScalpSample& sample : runs[1].samples) EXPECT_LE(sample.root_p95_deg, 20.01) << sample.time_s;
  EXPECT_GT(runs[0].samples.back().root_p95_deg, 30.0) << "the motion is one that needs a limit";
}

}  // namespace
}  // namespace strandcast::scalp_test
