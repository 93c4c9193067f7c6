#include "server/encode/picture_painter.h"

#include <epoxy/gl.h>

#include <array>
#include <atomic>
#include <fstream>
#include <mutex>

#include "common/groom/groom_asset.h"
#include "common/groom/procedural.h"
#include "common/render/renderer.h"
#include "common/strands/strand_codec.h"
#include "common/wire/messages.h"
#include "server/encode/frame_worker.h"
#include "tests/support/eventually.h"
#include "tests/support/gl_fixture.h"
#include "tests/support/sample_messages.h"
#include "tests/support/sanitizers.h"

namespace strandcast::picture_painter_test {
namespace {

constexpr float kHeadRadiusM = 0.095f;
constexpr float kQuantumM = 1e-4f;

std::shared_ptr<const SceneAsset> make_asset() {
  ProceduralGroomOptions options;
  options.strand_count = 80;
  options.vertex_count = 8;
  const auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 200), options);
  return std::make_shared<SceneAsset>(make_scene_asset(groom.value(), make_head(kHeadRadiusM)));
}

/// The asset's rest shape, blown sideways a bit more at every tick.
Snapshot make_state(const SceneAsset& asset, uint64_t tick) {
  std::vector<glm::vec3> positions = asset.rest_position_m;
  for (size_t i = 0; i < positions.size(); ++i)
    positions[i].x += 0.002f * static_cast<float>(tick * (i / asset.strand_count));
  QuantiseInput input;
  input.tick = tick;
  input.world_from_head.position_m = {3.0, 1.7, -2.0};
  input.world_from_head.rotation = glm::angleAxis(0.3, glm::dvec3(0.0, 1.0, 0.0));
  input.strand_count = asset.strand_count;
  input.vertex_count = asset.vertex_count;
  input.quantum_m = kQuantumM;
  input.position_in_head_m = positions;
  return quantise(input).snapshot;
}

PictureView small_view() {
  PictureView view;
  view.size = {160, 90};
  view.quality = 90;
  return view;
}

class GlPainting : public GlTest {
 protected:
  GlPainting() : asset_(make_asset()) {
    config_.asset = asset_;
    config_.device.renderer = "gl";
  }

  std::shared_ptr<const SceneAsset> asset_;
  PainterConfig config_;
};

TEST_F(GlPainting, PaintsWhatAClientDrawsFromTheSameBytes) {
  // What a client knows of the look is what came in the Welcome, and this one has no default in it.
  for (const auto& [renderer_name, is_main] :
       {std::pair{"gl", false},
        {"gl", true},
        {"tiles", true}}) {  // OpenGL's quads and tiles, the processor's
    SCOPED_TRACE(fmt::format("{}, {}", renderer_name, is_main ? "main methods" : "others"));
    config_.device.renderer = renderer_name;
    auto sent = std::get<Welcome>(sample_server_messages().front());
    if (is_main) sent.look.methods = {};
    const ServerMessage welcome = sent;
    config_.look = sent.look;
    const auto told = decode_server_message(encode(welcome));
    ASSERT_TRUE(told) << told.error().to_string();
    auto encoder = std::move(*make_strand_encoder("delta"));
    auto server_decoder =
        std::move(*make_strand_decoder("delta", {asset_->strand_count, asset_->vertex_count}));
    auto client_decoder =
        std::move(*make_strand_decoder("delta", {asset_->strand_count, asset_->vertex_count}));
    auto painter = device_picture_painter(config_)();  // its context is current from here on
    ASSERT_TRUE(painter) << painter.error().to_string();
    std::vector<Image> painted, drawn;
    std::vector<EncodedFramePtr> frames;
    for (uint64_t tick = 1; tick <= 3; ++tick) {
      frames.push_back(encoder->encode(make_state(*asset_, tick)));
      auto image = (*painter)->paint(*server_decoder->decode(frames.back()->message), small_view());
      ASSERT_TRUE(image) << image.error().to_string();
      painted.push_back(std::move(image).value());
    }
    painter->reset();
    const auto device = RenderDevice::open(config_.device);
    ASSERT_TRUE(device) << device.error().to_string();
    auto renderer = (*device)->make_renderer(*asset_, std::get<Welcome>(*told).look);
    ASSERT_TRUE(renderer) << renderer.error().to_string();
    for (const EncodedFramePtr& frame : frames) {
      const auto snapshot = *client_decoder->decode(frame->message);
      const PosedStrands strands{snapshot->world_from_head, positions_in_head(*snapshot)};
      ASSERT_TRUE((*renderer)->draw(strands, small_view().camera, small_view().size));
      drawn.push_back((*renderer)->read_image());
    }
    for (size_t i = 0; i < painted.size(); ++i) EXPECT_TRUE(painted[i] == drawn[i]) << "frame " << i;
    EXPECT_FALSE(painted[0] == painted[2]) << "the hair moved";
  }
}

// Both were there before it changed.
TEST_F(GlPainting, PaintsAChangedLookAsAClientDoesThatWasToldOfIt) {
  config_.look = sample_look();
  auto renderer = Renderer::make(gl::ShaderLibrary(), context_->info(), *asset_, sample_look());
  ASSERT_TRUE(renderer) << renderer.error().to_string();
  const auto state = std::make_shared<const Snapshot>(make_state(*asset_, 2));
  const PosedStrands strands{state->world_from_head, positions_in_head(*state)};
  const auto draw = [&] {
    EXPECT_TRUE((*renderer)->draw(strands, small_view().camera, small_view().size));
    return (*renderer)->read_image();
  };
  const Image before = draw();
  auto painter = device_picture_painter(config_)();  // its context is current from here on
  ASSERT_TRUE(painter) << painter.error().to_string();
  ASSERT_TRUE((*painter)->paint(state, small_view()).value() == before);
  const auto told = decode_server_message(encode(ServerMessage(LookChange{second_sample_look(), {}})));
  ASSERT_TRUE(told) << told.error().to_string();
  ASSERT_TRUE((*painter)->set_look(second_sample_look()));
  const Image painted = (*painter)->paint(state, small_view()).value();
  ASSERT_TRUE(context_->make_current());
  ASSERT_TRUE((*renderer)->set_look(std::get<LookChange>(*told).look));
  EXPECT_TRUE(painted == draw());
  EXPECT_FALSE(painted == before);
  renderer->reset();  // while its context is current
}

TEST_F(GlPainting, ATickThatComesAgainIsPaintedAgain) {
  auto painter = device_picture_painter(config_)();
  ASSERT_TRUE(painter) << painter.error().to_string();
  const auto paint = [&](const std::shared_ptr<const Snapshot>& snapshot) {
    auto image = (*painter)->paint(snapshot, small_view());
    EXPECT_TRUE(image) << image.error().to_string();
    return image ? std::move(image).value() : Image{};
  };
  const auto blown = std::make_shared<Snapshot>(make_state(*asset_, 30));
  auto after_reset = std::make_shared<Snapshot>(make_state(*asset_, 0));
  after_reset->tick = blown->tick;
  const Image first = paint(blown);
  const Image second = paint(after_reset);
  EXPECT_FALSE(first == second) << "the picture before the reset is shown after it";
  EXPECT_TRUE(paint(blown) == first);
}

TEST_F(GlPainting, EveryViewThatIsAcceptedCanBePainted) {
  auto painter = device_picture_painter(config_)();
  ASSERT_TRUE(painter) << painter.error().to_string();
  const auto snapshot = std::make_shared<const Snapshot>(make_state(*asset_, 1));
  std::vector<PictureView> views;
  const auto add = [&](glm::vec3 offset_m, glm::vec3 target_m, float fov_y_rad, RenderSize size) {
    PictureView view;
    view.camera = {offset_m, target_m, fov_y_rad};
    view.size = size;
    views.push_back(view);
  };
  constexpr RenderSize kSize{160, 90};
  add({0.0f, 0.0f, 1e-3f}, {0.0f, 0.0f, 0.0f}, 3.0f, kSize);   // inside the head
  add({0.0f, 0.0f, 1e4f}, {0.0f, 0.0f, 0.0f}, 0.01f, kSize);   // as far as it goes
  add({0.0f, 1e4f, 0.0f}, {0.0f, 0.0f, 0.0f}, 3.0f, kSize);    // straight down
  add({0.0f, -0.5f, 0.0f}, {0.0f, 1e4f, 0.0f}, 1.0f, kSize);   // straight up, past everything
  add({1e-3f, 0.0f, 0.0f}, {5e3f, 5e3f, 5e3f}, 0.01f, kSize);  // nothing to see
  add({0.0f, 0.0f, 0.5f}, {0.0f, 0.0f, 0.0f}, 1.0f, {kMaxPictureWidth, kMinPictureSide});
  add({0.0f, 0.0f, 0.5f}, {0.0f, 0.0f, 0.0f}, 1.0f, {kMinPictureSide, kMaxPictureHeight});
  for (const PictureView& view : views) {
    ASSERT_TRUE(validate(view)) << validate(view).error().to_string();
    const auto image = (*painter)->paint(snapshot, view);
    ASSERT_TRUE(image) << image.error().to_string();
    EXPECT_EQ(image->rgba.size(), size_t{4} * view.size.width * view.size.height);
  }
}

TEST_F(GlPainting, AFrameWorkerSendsPicturesOfTheHead) {
  auto encoder = std::move(*make_strand_encoder("delta"));
  encoder->encode(make_state(*asset_, 1));
  std::mutex mutex;
  std::vector<PicturePtr> pictures;
  std::atomic<int> requests{0};
  FrameWorker::Hooks hooks;
  hooks.sink = [&](uint32_t, PicturePtr frame) {
    const std::lock_guard lock(mutex);
    pictures.push_back(std::move(frame));
  };
  hooks.request_keyframe = [&] { ++requests; };
  FrameWorker worker(std::move(*make_strand_decoder("delta", {asset_->strand_count, asset_->vertex_count})),
                     device_picture_painter(config_), {1000.0}, std::move(hooks));
  worker.set_views({{1, small_view()}});
  ASSERT_TRUE(eventually([&] { return requests > 0; }));
  worker.offer(encoder->encode_for_join(make_state(*asset_, 1)).keyframe);
  const auto has_picture = [&] {
    const std::lock_guard lock(mutex);
    return !pictures.empty();
  };
  ASSERT_TRUE(eventually([&] { return has_picture() || worker.failure(); }));
  ASSERT_FALSE(worker.failure()) << worker.failure()->to_string();
  const auto image = decode_jpeg(std::span(pictures[0]->after(0)->message).subspan(kFrameHeaderBytes));
  ASSERT_TRUE(image) << image.error().to_string();
  ASSERT_EQ(image->width, 160u);
  ASSERT_EQ(image->height, 90u);
  // The camera looks at the head: the middle differs from a corner, which shows the background.
  const uint8_t* corner = image->rgba.data();
  const uint8_t* middle = image->rgba.data() + 4 * (45 * 160 + 80);
  const int difference =
      std::abs(corner[0] - middle[0]) + std::abs(corner[1] - middle[1]) + std::abs(corner[2] - middle[2]);
  EXPECT_GT(difference, 20);
}

/// Names and fates: what a list says that does not depend on the machine.
std::vector<std::pair<std::string, gl::PassFate>> decisions(const gl::PassReports& passes) {
  std::vector<std::pair<std::string, gl::PassFate>> decided;
  for (const gl::PassReport& pass : passes) decided.emplace_back(pass.name, pass.fate);
  return decided;
}

TEST_F(GlPainting, TheFrameThreadHoldsGlAndHasPassesOnlyWhileSomebodyWatches) {
  const gl::ObjectCounts before = gl::object_counts();
  auto encoder = std::move(*make_strand_encoder("delta"));
  encoder->encode(make_state(*asset_, 1));
  std::atomic<int> pictures{0};
  std::atomic<int> requests{0};
  FrameWorker::Hooks hooks;
  hooks.sink = [&](uint32_t, PicturePtr) { ++pictures; };
  hooks.request_keyframe = [&] { ++requests; };
  FrameWorker worker(std::move(*make_strand_decoder("delta", {asset_->strand_count, asset_->vertex_count})),
                     device_picture_painter(config_), {1000.0}, std::move(hooks));
  worker.offer(encoder->encode_for_join(make_state(*asset_, 1)).keyframe);  // for nobody
  EXPECT_TRUE(worker.passes().empty());

  worker.set_views({{1, small_view()}});
  ASSERT_TRUE(eventually([&] { return requests > 0; }));
  EXPECT_EQ(gl::object_counts(), before) << "no context, no program, no buffer before the first viewer";
  worker.offer(encoder->encode_for_join(make_state(*asset_, 2)).keyframe);
  ASSERT_TRUE(eventually([&] { return pictures > 0 || worker.failure(); }));
  ASSERT_FALSE(worker.failure()) << worker.failure()->to_string();
  EXPECT_EQ(gl::object_counts().contexts, before.contexts + 1);
  const gl::PassReports ran = worker.passes();
  const auto planned =
      plan_picture_passes(*asset_, config_.look, RendererKind::Gl, codec_bit(PictureCodec::Jpeg));
  ASSERT_TRUE(planned) << planned.error().to_string();
  EXPECT_EQ(decisions(ran), decisions(*planned));
  for (const gl::PassReport& pass : ran)
    EXPECT_EQ(pass.runs > 0, pass.fate == gl::PassFate::Kept) << pass.name;

  worker.set_views({});
  ASSERT_TRUE(eventually([&] { return gl::object_counts().contexts == before.contexts; }));
  EXPECT_TRUE(eventually([&] { return worker.passes().empty(); }));
  gl::ObjectCounts after = gl::object_counts();
  after.compiled_programs = before.compiled_programs;  // counts on
  EXPECT_EQ(after, before);
}

TEST_F(GlPainting, AnUnknownDeviceIsAnErrorThatNamesTheKnownOnes) {
  config_.device.gl_device = "abacus";
  const auto painter = device_picture_painter(config_)();
  ASSERT_FALSE(painter);
  EXPECT_THAT(painter.error().message, testing::HasSubstr("known: auto, software, hardware"));
}

/// Bytes of this process that are in memory, at most so far.
uint64_t most_resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (uint64_t kilobytes = 0; word == "VmHWM:" && status >> kilobytes) return kilobytes << 10;
  ADD_FAILURE() << "/proc/self/status does not tell VmHWM";
  return 0;
}

class PaintingMemory : public GlTest {};

// By how much the largest picture raises the peak beyond that of a small one, full of hair as the built-in
// scene is.
TEST_F(PaintingMemory, APixelTakesWithoutAGpuWhatTheBudgetCounts) {
  if (test::kHasSanitizer) GTEST_SKIP() << "a sanitizer's allocator takes memory of its own";
  if (!context_->info().is_software)
    GTEST_SKIP() << "on a GPU pictures are not drawn in the process's memory";
  ProceduralGroomOptions options;
  options.strand_count = 2'000;
  options.vertex_count = 16;
  const auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 4'000), options);
  PainterConfig config;
  config.asset = std::make_shared<SceneAsset>(make_scene_asset(groom.value(), make_head(kHeadRadiusM)));
  auto painter = device_picture_painter(config)();
  ASSERT_TRUE(painter) << painter.error().to_string();
  const auto state = std::make_shared<const Snapshot>(make_state(*config.asset, 1));
  const auto paint = [&](uint32_t width, uint32_t height) {
    PictureView view;
    view.size = {width, height};
    const auto image = (*painter)->paint(state, view);
    ASSERT_TRUE(image) << image.error().to_string();
  };
  paint(32, 18);
  const uint64_t before = most_resident_bytes();
  paint(1280, 720);
  EXPECT_LE(most_resident_bytes() - before, kDrawnPixelBytes * 1280 * 720);
}

}  // namespace
}  // namespace strandcast::picture_painter_test
