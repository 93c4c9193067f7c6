// StrandDrawer: pictures from a thread of its own, coarse while something moves, whole once all stands.
#include "client/app/strand_drawer.h"

#include <gtest/gtest.h>

#include "tests/support/eventually.h"
#include "tests/support/hair_motion.h"
#include "tests/support/sample_asset.h"

namespace strandcast::strand_drawer_test {
namespace {

constexpr uint32_t kStrands = 60;
constexpr uint32_t kVertices = 8;
constexpr RenderSize kWindow{160, 120};

class StrandDrawerTest : public testing::Test {
 protected:
  /// What a connection that was made with this asset has, with the hair of now.
  std::shared_ptr<const ViewerState> state() {
    auto made = std::make_shared<ViewerState>();
    made->session_number = 1;
    made->asset = asset_;
    made->timeline.add(std::make_shared<const Snapshot>(hair_.snapshot(quantum_for_bound(1e-4f))), now_ns(),
                       Continuity::SameStream);
    return made;
  }
  static DrawView view(float from_m = 0.8f) {
    DrawView seen;
    seen.camera.offset_m = {0.0f, 0.0f, from_m};
    seen.size = kWindow;
    return seen;
  }
  static StrandDrawer::Config config(const std::string& device) {
    StrandDrawer::Config wanted;
    wanted.device.gl_device = device;
    wanted.on_news = [] {};
    return wanted;
  }

  HairMotion hair_{{.strand_count = kStrands, .vertex_count = kVertices}};
  std::shared_ptr<const SceneAsset> asset_ =
      std::make_shared<const SceneAsset>(sample_asset(kStrands, kVertices));
};

TEST_F(StrandDrawerTest, SharpensWhatStandsAndThenDrawsNothingMore) {
  StrandDrawer drawer(config("software"));
  drawer.set_state(state());
  drawer.set_view(view());
  ASSERT_TRUE(eventually([&] { return drawer.look().image != nullptr; }));
  ASSERT_TRUE(eventually([&] { return drawer.look().step == 0; })) << "whole at last";
  const DrawnState whole = drawer.look();
  ASSERT_TRUE(whole.device && whole.device->ok());
  EXPECT_EQ(whole.image->width, kWindow.width);
  EXPECT_EQ(whole.image->height, kWindow.height);
  EXPECT_GT(whole.count, 1u) << "a coarse one came first";
  // The same again, told as a new state: nobody would see a difference.
  for (int turn = 0; turn < 10; ++turn) {
    drawer.set_state(state());
    drawer.set_view(view());
    give_time_to_misbehave();
  }
  EXPECT_EQ(drawer.look().count, whole.count);
  // Another view is drawn, and what it took is told.
  drawer.set_view(view(0.5f));
  ASSERT_TRUE(eventually([&] { return drawer.look().count > whole.count; }));
  EXPECT_GT(drawer.look().fair_ms, 0.0);
}

// Hair that stands is drawn again, and the picture before stays until the next is there.
TEST_F(StrandDrawerTest, FollowsTheLookOfTheSceneOrOnesOwn) {
  StrandDrawer drawer(config("software"));
  const auto told = [&](const std::string& color) {
    auto now = std::make_shared<ViewerState>(*state());
    now->look.look.hair_color = color;
    return now;
  };
  const auto whole = [&](const std::shared_ptr<const Image>& after) {
    EXPECT_TRUE(eventually([&] {
      const DrawnState now = drawer.look();
      EXPECT_TRUE(after == nullptr || now.image != nullptr) << "never blank";
      return now.image != nullptr && now.image != after && now.step == 0 && !(after && *now.image == *after);
    }));
    return drawer.look().image;
  };
  const LookDesc plain = told("custom")->look.look;
  drawer.set_state(told("custom"));
  drawer.set_view(view());
  const auto first = whole(nullptr);
  LookDesc own = plain;
  own.background = {0.9f, 0.1f, 0.1f};
  drawer.set_own_look(own);
  const auto second = whole(first);
  auto of_all = std::make_shared<ViewerState>(*told("custom"));
  of_all->look.look.background = {0.1f, 0.9f, 0.1f};
  drawer.set_state(of_all);
  give_time_to_misbehave();
  EXPECT_TRUE(*drawer.look().image == *second) << "one's own is seen";
  drawer.set_own_look(std::nullopt);
  const auto third = whole(second);
  drawer.set_state(told("custom"));
  EXPECT_TRUE(*whole(third) == *first) << "and back to what it was";
  EXPECT_FALSE(drawer.look().look_trouble);
}

TEST_F(StrandDrawerTest, DrawsNothingThatNobodySees) {
  StrandDrawer drawer(config("software"));
  drawer.set_state(state());
  ASSERT_TRUE(eventually([&] { return drawer.look().device.has_value(); }));
  give_time_to_misbehave();
  EXPECT_EQ(drawer.look().count, 0u);
  drawer.set_view(view());
  ASSERT_TRUE(eventually([&] { return drawer.look().step == 0 && drawer.look().count > 0; }));
  const uint64_t count = drawer.look().count;
  drawer.set_view(std::nullopt);
  hair_.step();
  drawer.set_state(state());
  give_time_to_misbehave();
  EXPECT_EQ(drawer.look().count, count);
}

TEST_F(StrandDrawerTest, DrawsWholeWhenAsked) {
  StrandDrawer drawer(config("software"));
  drawer.set_state(state());
  drawer.set_view(view());
  for (int turn = 0; turn < 3; ++turn) {
    const uint64_t asked = drawer.ask_whole();
    ASSERT_TRUE(eventually([&] { return drawer.look().asked_whole == asked; }));
    EXPECT_EQ(drawer.look().image->width, kWindow.width) << turn;
  }
}

TEST_F(StrandDrawerTest, SaysWhyItCannotDraw) {
  StrandDrawer nowhere(config("99"));
  ASSERT_TRUE(eventually([&] { return nowhere.look().device.has_value(); }));
  EXPECT_FALSE(nowhere.look().device->ok());
  nowhere.set_view(view());
  nowhere.set_state(state());

  SceneAsset broken = *asset_;
  broken.triangle.push_back({0, 1, kStrands});
  const auto good = std::exchange(asset_, std::make_shared<const SceneAsset>(broken));
  StrandDrawer drawer(config("software"));
  drawer.set_view(view());
  drawer.set_state(state());
  ASSERT_TRUE(eventually([&] { return drawer.look().trouble.has_value(); }));
  EXPECT_EQ(drawer.look().trouble->code, ErrorCode::BadInput);
  asset_ = good;
  drawer.set_state(state());
  ASSERT_TRUE(eventually([&] { return drawer.look().image != nullptr; })) << "the next scene can be drawn";
  EXPECT_FALSE(drawer.look().trouble);
}

}  // namespace
}  // namespace strandcast::strand_drawer_test
