// A look that changes on a renderer: the pixels are those of one that was made with it.
#include <epoxy/gl.h>

#include "common/render/render_path.h"
#include "common/render/renderer.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/look_variants.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sample_look.h"
#include "tests/support/test_grid.h"

namespace strandcast::set_look_test {
namespace {

constexpr RenderSize kSize{96, 72};

/// With quads and with tiles.
class SetLookTest : public GlTest, public testing::WithParamInterface<const RenderPath*> {
 protected:
  void TearDown() override { EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)); }

  std::unique_ptr<Renderer> make(const LookDesc& look) {
    auto made = Renderer::make(gl::ShaderLibrary(), context_->info(), asset_, look, *path_);
    EXPECT_TRUE(made) << made.error().to_string();
    return made ? std::move(*made) : nullptr;
  }
  Image draw(Renderer& renderer) {
    const Status status =
        renderer.draw({{}, asset_.rest_position_m}, {{0.0f, 0.05f, 0.6f}, {0.0f, 0.0f, 0.0f}, 0.7f}, kSize);
    EXPECT_TRUE(status) << status.error().to_string();
    return renderer.read_image();
  }

  /// A look where no field that this path draws has its default.
  LookDesc sample() const {
    LookDesc look = sample_look();
    if (path_ == &tile_path()) look.methods = {};
    return look;
  }

  const RenderPath* const path_ = GetParam();
  const SceneAsset asset_ = sample_asset(60, 8);
};

INSTANTIATE_TEST_SUITE_P(Paths, SetLookTest, testing::Values(&segment_path(), &tile_path()),
                         [](const auto& path) { return path.param->name; });

// Field after field, each on top of those before. A field that does not arrive shows in the next picture that
// is compared, as all later looks have it too.
TEST_P(SetLookTest, EveryFieldReachesThePixelsAsIfTheRendererWereMadeWithIt) {
  const auto renderer = make({});
  ASSERT_NE(renderer, nullptr);
  const Image before = draw(*renderer);
  Image last = before;
  LookDesc look;
  const size_t count = test::fields_of(look).size();
  // To draw, and to make a renderer, takes most of the time: on the small grid for every tenth.
  const size_t stride = static_cast<size_t>(on_grid(10, 1));
  size_t compared = 0, seen = 0;
  for (size_t index = 0; index < count; ++index) {
    const auto [path, next] = test::looks_one_field_apart(look, sample()).at(index);
    SCOPED_TRACE(path);
    if (path.starts_with("methods") && path_ == &tile_path()) continue;
    ASSERT_NE(next, look) << "the sample has the default here";
    look = next;
    ASSERT_TRUE(renderer->set_look(look));
    if (index % stride != 0 && index + 1 < count) continue;
    const Image changed = draw(*renderer);
    const auto fresh = make(look);
    ASSERT_NE(fresh, nullptr);
    EXPECT_TRUE(changed == draw(*fresh));
    ++compared;
    seen += changed == last ? 0 : 1;
    last = changed;
  }
  EXPECT_GE(2 * seen, compared)
      << "most of what is told above would hold for a renderer that ignores every look";
  ASSERT_TRUE(renderer->set_look({}));
  EXPECT_TRUE(draw(*renderer) == before) << "and back";
}

// What the passes are made for is allocated for the newest look alone; colours allocate nothing.
TEST_P(SetLookTest, HoldsWhatTheNewestLookNeeds) {
  LookDesc look;
  const auto renderer = make(look);
  ASSERT_NE(renderer, nullptr);
  draw(*renderer);
  const gl::ObjectCounts held = gl::object_counts();
  look.root_color.r = 0.5f;
  look.style.clump = 0.1f;
  ASSERT_TRUE(renderer->set_look(look));
  draw(*renderer);
  EXPECT_EQ(gl::object_counts(), held) << "nothing is compiled or allocated for a colour";
  look.followers = 0;
  ASSERT_TRUE(renderer->set_look(look));
  draw(*renderer);
  const uint64_t fewer = renderer->passes().live_bytes();
  const auto fresh = make(look);
  ASSERT_NE(fresh, nullptr);
  draw(*fresh);
  EXPECT_EQ(fewer, fresh->passes().live_bytes());
  ASSERT_TRUE(renderer->set_look({}));
  draw(*renderer);
  EXPECT_GT(renderer->passes().live_bytes(), fewer);
}

}  // namespace
}  // namespace strandcast::set_look_test
