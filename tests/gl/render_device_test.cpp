// What draws: the rule, and a look that takes the picture from one renderer to the other.
#include "common/render/render_device.h"

#include "common/render/tiles/tile_renderer.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/sample_asset.h"

namespace strandcast::render_device_test {
namespace {

using testing::HasSubstr;

class RenderDevices : public GlTest {
 protected:
  static std::unique_ptr<RenderDevice> open(const std::string& renderer,
                                            const std::string& gl_device = "auto") {
    auto device = RenderDevice::open({renderer, gl_device, {}});
    EXPECT_TRUE(device) << device.error().to_string();
    return device ? std::move(device).value() : nullptr;
  }
  Image draw(Renderer& renderer) {
    const Status status = renderer.draw({{}, asset_.rest_position_m}, {}, {64, 48});
    EXPECT_TRUE(status) << status.error().to_string();
    return renderer.read_image();
  }
  static LookDesc named() {
    LookDesc look;
    look.methods.shading = "karis";
    return look;
  }

  SceneAsset asset_ = sample_asset(12, 6);
};

TEST_F(RenderDevices, TilesDrawUnlessTheDeviceIsHardware) {
  EXPECT_EQ(open("tiles")->info().kind, RendererKind::Tiles);
  EXPECT_EQ(open("gl")->info().kind, RendererKind::Gl);
  const auto chosen = open("auto");
  EXPECT_EQ(chosen->info().kind, context_->info().is_software ? RendererKind::Tiles : RendererKind::Gl);
  EXPECT_EQ(chosen->info().is_software, context_->info().is_software);
  for (const char* renderer : {"auto", "gl"})
    EXPECT_EQ(is_drawn_by_processors({renderer, "auto", {}}), context_->info().is_software) << renderer;
  EXPECT_TRUE(is_drawn_by_processors({"tiles", "auto", {}}));
  EXPECT_TRUE(is_drawn_by_processors({"gl", "999", {}})) << "nothing draws";
  EXPECT_FALSE(chosen->info().name.empty());
}

TEST_F(RenderDevices, WhatIsAskedForByNameIsThereOrAnError) {
  const auto unknown = RenderDevice::open({"abacus", "auto", {}});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("known: auto, tiles, gl"));
  EXPECT_FALSE(RenderDevice::open({"auto", "99", {}}));
  EXPECT_FALSE(RenderDevice::open({"gl", "99", {}}));
  EXPECT_TRUE(RenderDevice::open({"tiles", "99", {}})) << "tiles ask no device";
}

TEST_F(RenderDevices, ALookThatNamesAMethodIsDrawnByOpenGl) {
  Image expected;
  {
    const auto gl = open("gl");
    auto renderer = gl->make_renderer(asset_, named());
    ASSERT_TRUE(renderer);
    expected = draw(**renderer);
  }
  const auto device = open("auto");
  if (device->info().kind == RendererKind::Gl)
    GTEST_SKIP() << "this machine has a hardware GPU: OpenGL draws all";
  EXPECT_EQ(device->kind_for({}), RendererKind::Tiles);
  EXPECT_EQ(device->kind_for(named()), RendererKind::Gl);
  auto renderer = device->make_renderer(asset_, {});
  ASSERT_TRUE(renderer);
  const Image in_tiles = draw(**renderer);
  ASSERT_TRUE((*renderer)->set_look(named()));
  EXPECT_TRUE(draw(**renderer) == expected);
  EXPECT_FALSE(in_tiles == expected);
  ASSERT_TRUE((*renderer)->set_look({}));
  EXPECT_TRUE(draw(**renderer) == in_tiles) << "and back";
}

TEST_F(RenderDevices, TilesAloneRefuseWhatTheyDoNotDraw) {
  const auto device = open("tiles");
  const auto refused = device->make_renderer(asset_, named());
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("only OpenGL draws"));
  auto renderer = device->make_renderer(asset_, {});
  ASSERT_TRUE(renderer);
  const Image before = draw(**renderer);
  EXPECT_FALSE((*renderer)->set_look(named()));
  EXPECT_TRUE(draw(**renderer) == before) << "the look of before stays";
}

TEST_F(RenderDevices, PlansAreTheListsThatRun) {
  for (const RendererKind kind : {RendererKind::Tiles, RendererKind::Gl}) {
    const auto planned = plan_renderer(asset_, {}, kind);
    ASSERT_TRUE(planned);
    auto device = open(to_string(kind));
    auto renderer = device->make_renderer(asset_, {});
    ASSERT_TRUE(renderer);
    const gl::PassReports run = (*renderer)->passes().report();
    ASSERT_EQ(planned->size(), run.size()) << to_string(kind);
    for (size_t i = 0; i < run.size(); ++i) {
      EXPECT_EQ((*planned)[i].name, run[i].name);
      EXPECT_EQ((*planned)[i].fate, run[i].fate) << run[i].name;
    }
  }
  EXPECT_EQ(likely_renderer("auto", {}), RendererKind::Tiles);
  EXPECT_EQ(likely_renderer("auto", named()), RendererKind::Gl);
  EXPECT_EQ(likely_renderer("gl", {}), RendererKind::Gl);
}

TEST_F(RenderDevices, ATileRendererFollowsItsLook) {
  LookDesc red;
  red.hair_color = "red";
  red.style.frizz_m = 0.002f;
  red.followers = 1;
  auto changed = make_tile_renderer(asset_, {});
  auto made = make_tile_renderer(asset_, red);
  ASSERT_TRUE(changed && made);
  const Image before = draw(**changed);
  ASSERT_TRUE((*changed)->set_look(red));
  EXPECT_TRUE(draw(**changed) == draw(**made));
  EXPECT_FALSE(draw(**made) == before);
}

}  // namespace
}  // namespace strandcast::render_device_test
