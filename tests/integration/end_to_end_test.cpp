// The whole product in one process: server with simulation, encode, frame and network threads, a source that
// feeds it over the network, and viewers that decode and draw what it streams.
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "client/app/feed.h"
#include "client/app/look_form.h"
#include "client/app/stream_check.h"
#include "client/app/views.h"
#include "common/base/file.h"
#include "common/motion/motion_clip.h"
#include "common/render/render_device.h"
#include "common/scene/scene_file.h"
#include "server/app/viewer_codec.h"
#include "server/net/strand_class.h"
#include "tests/support/look_variants.h"
#include "tests/support/raw_client.h"
#include "tests/support/sample_look.h"
#include "tests/support/server_fixture.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::end_to_end_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr uint32_t kStrands = 150;
constexpr uint32_t kVertices = 8;
constexpr milliseconds kWait{50};
constexpr double kDeadlineS = 60.0;  // never reached by code that works

/// What the server's frame thread painted, before JPEG.
struct Painted {
  uint64_t tick = 0;
  PictureView view;
  Image image;
  LookDesc look;
};

/// Everything seen from inside the server.
class Observer {
 public:
  void saw(const Snapshot& snapshot) {
    const std::lock_guard lock(mutex_);
    published_[snapshot.tick] = snapshot;
  }
  void saw(Painted painted) {
    constexpr size_t kKept = 400;
    const std::lock_guard lock(mutex_);
    if (painted_.size() < kKept) painted_.push_back(std::move(painted));
  }
  std::map<uint64_t, Snapshot> published() const {
    const std::lock_guard lock(mutex_);
    return published_;
  }
  std::vector<Painted> painted() const {
    const std::lock_guard lock(mutex_);
    return painted_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<uint64_t, Snapshot> published_;
  std::vector<Painted> painted_;
};

class ObservedPainter : public PicturePainter {
 public:
  ObservedPainter(std::unique_ptr<PicturePainter> painter, const LookDesc& look, Observer& observer)
      : painter_(std::move(painter)), look_(look), observer_(observer) {}
  Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) override {
    auto image = painter_->paint(snapshot, view);
    if (image) observer_.saw({snapshot->tick, view, *image, look_});
    return image;
  }
  Status set_look(const LookDesc& look) override {
    RETURN_IF_ERROR(painter_->set_look(look));
    look_ = look;
    return {};
  }

 private:
  std::unique_ptr<PicturePainter> painter_;
  LookDesc look_;
  Observer& observer_;
};

class EndToEnd : public test::ServerFixture {
 protected:
  void SetUp() override {
    ServerConfig config;
    config.scene = test::small_scene(kStrands, kVertices);
    config.scene.look = sample_look();  // all of it has to reach the viewers
    config.scene.camera = sample_camera();
    config.scene.stream.frame_width = 96;
    config.scene.stream.frame_height = 64;
    config.on_publish = [this](const auto& snapshot) { observer_.saw(*snapshot); };
    config.make_painter = [this](PainterConfig painter) -> MakePicturePainter {
      return [this, look = painter.look,
              make = device_picture_painter(painter)]() -> Result<std::unique_ptr<PicturePainter>> {
        ASSIGN_OR_RETURN(auto made, make());
        return std::unique_ptr<PicturePainter>(
            std::make_unique<ObservedPainter>(std::move(made), look, observer_));
      };
    };
    (void)start(std::move(config));
  }

  void TearDown() override {
    stop_feeding_ = true;
    if (feeder_.joinable()) feeder_.join();
    ServerFixture::TearDown();
  }

  std::unique_ptr<ViewerSession> join(StreamMode mode = StreamMode::Strands, Role role = Role::Viewer) {
    return open(client_config(mode, role));
  }

  /// The built-in head motion, over the network, until the test ends.
  void start_feeding() {
    feeder_ = std::thread([this] {
      auto client = std::make_unique<SteadyClient>(client_config(StreamMode::Strands, Role::Source));
      const Status joined = client->await_welcome(stop_feeding_);
      ASSERT_TRUE(joined) << joined.error().to_string();
      FeedPlan plan;
      plan.motion = built_in_motion;
      const auto fed = feed({&client, 1}, plan, stop_feeding_, {});
      EXPECT_TRUE(fed) << fed.error().to_string();
    });
  }

  Observer observer_;
  std::atomic<bool> stop_feeding_{false};
  std::thread feeder_;
};

/// What a session decodes, by tick.
using States = std::map<uint64_t, std::shared_ptr<const Snapshot>>;

void record(ViewerSession& session, States& states) {
  session.set_snapshot_listener([&states](const auto& snapshot) { states[snapshot->tick] = snapshot; });
}

/// Every decoded vertex lies within the announced bound of the published one, poses are the same.
void expect_within_bound(const States& states, const std::map<uint64_t, Snapshot>& published, float bound_m) {
  for (const auto& [tick, state] : states) {
    ASSERT_TRUE(published.contains(tick)) << tick;
    EXPECT_EQ(state->world_from_head, published.at(tick).world_from_head);
    const auto shown = positions_in_head(*state);
    const auto truth = positions_in_head(published.at(tick));
    ASSERT_EQ(shown.size(), truth.size());
    for (size_t i = 0; i < shown.size(); ++i)
      ASSERT_LE(glm::distance(glm::dvec3(shown[i]), glm::dvec3(truth[i])), bound_m) << "tick " << tick;
  }
}

TEST_F(EndToEnd, TwoViewersDecodeTheSameStatesBitForBitEvenWhenOneJoinsLate) {
  start_feeding();
  States early_states;
  States late_states;
  auto first = join();
  ASSERT_TRUE(first);
  record(*first, early_states);
  ASSERT_TRUE(pump_until({first.get()}, [&] { return early_states.size() >= 40; }));
  auto late = join();
  ASSERT_TRUE(late);
  record(*late, late_states);
  ASSERT_TRUE(pump_until({first.get(), late.get()}, [&] {
    const auto newest = late->replay().newest();
    return late_states.size() >= 40 && newest && newest->motion_time_ns != 0;
  }));
  EXPECT_NE(late->replay().newest()->world_from_head, Pose{}) << "the fed head motion reached the viewers";

  size_t common_count = 0;
  for (const auto& [tick, state] : late_states) {
    const auto same = early_states.find(tick);
    if (same == early_states.end()) continue;
    ++common_count;
    EXPECT_EQ(state_hash(*same->second), state_hash(*state)) << "tick " << tick;
  }
  EXPECT_GE(common_count, 20u);
  const float bound_m = first->welcome().bound_m;
  for (const auto* states : {&early_states, &late_states})
    expect_within_bound(*states, observer_.published(), bound_m);
  for (const ViewerSession* session : {first.get(), late.get()}) {
    EXPECT_EQ(session->replay().stats().rejected_frames, 0u) << session->replay().stats().last_error;
    EXPECT_GE(session->replay().stats().keyframes, 1u);
    ASSERT_NE(session->asset(), nullptr);
    EXPECT_EQ(session->asset()->strand_count, kStrands);
  }
  EXPECT_GT(late_states.begin()->first, early_states.begin()->first);
}

TEST_F(EndToEnd, AKilledViewerDisturbsNobody) {
  States states;
  auto survivor = join();
  ASSERT_TRUE(survivor);
  record(*survivor, states);
  {
    test::RawClient victim(server_->port());
    ASSERT_TRUE(victim.handshake());
    victim.send(Hello{});
    ASSERT_TRUE(victim.read_media(Opcode::StrandKeyframe));
    victim.reset();
  }
  ASSERT_TRUE(pump_until({survivor.get()}, [&] {
    return states.size() >= 60 && survivor->has_status() && survivor->status().viewer_count == 1;
  }));
  EXPECT_EQ(survivor->replay().stats().rejected_frames, 0u);
  expect_within_bound(states, observer_.published(), survivor->welcome().bound_m);
}

TEST_F(EndToEnd, TheServersFramesAreTheClientsPixelsByteForByte) {
  start_feeding();
  std::map<uint64_t, std::shared_ptr<const Snapshot>> decoded;
  auto strands = join();
  auto frames = join(StreamMode::Frames);
  ASSERT_TRUE(strands && frames);
  // Pictures show what the first class decodes to; on a busy machine a viewer may get another one for a
  // while.
  strands->set_snapshot_listener([&](const auto& snapshot) {
    if (strands->quality().stream_id == 0) decoded[snapshot->tick] = snapshot;
  });
  const auto common_pictures = [&] {
    std::vector<Painted> common;
    for (Painted& painted : observer_.painted())
      if (decoded.contains(painted.tick)) common.push_back(std::move(painted));
    return common;
  };
  ASSERT_TRUE(pump_until({strands.get(), frames.get()},
                         [&] { return frames->image_count() >= 3 && common_pictures().size() >= 3; }));

  const auto device = RenderDevice::open({});
  ASSERT_TRUE(device) << device.error().to_string();
  const Welcome& welcome = frames->welcome();
  auto renderer = (*device)->make_renderer(*strands->asset(), welcome.look);
  ASSERT_TRUE(renderer) << renderer.error().to_string();
  StrandFill fill;  // these states have all strands
  std::vector<Image> drawn;
  for (const Painted& server : common_pictures()) {
    const RenderSize size{welcome.frame_width, welcome.frame_height};
    ASSERT_TRUE((*renderer)->draw(posed_strands_of(*decoded.at(server.tick), fill), welcome.camera, size));
    const Image client = (*renderer)->read_image();
    ASSERT_EQ(client.width, server.image.width);
    ASSERT_EQ(client.height, server.image.height);
    EXPECT_TRUE(client.rgba == server.image.rgba) << "tick " << server.tick;
    drawn.push_back(client);
  }
  // The head moves, so that equal pictures are not equal because nothing changes; and they show something.
  EXPECT_FALSE(drawn.front().rgba == drawn.back().rgba);
  const auto [darkest, brightest] = std::minmax_element(drawn[0].rgba.begin(), drawn[0].rgba.end());
  EXPECT_GT(*brightest - *darkest, 60);
}

/// What `strandcast-ctl set` takes to give the scene this look.
std::string assignment_of(const LookDesc& look) {
  std::vector<FormEdit> edits;
  for (const auto& [path, value] : test::fields_of(look)) edits.push_back({path, value});
  return look_assignment(edits);
}

// While all are connected, with a look in which no field is as it was nor as it is by default.
TEST_F(EndToEnd, AfterALiveChangeTheServersFramesAreStillTheClientsPixels) {
  const LookDesc look = second_sample_look();
  const auto before = test::fields_of(sample_look());
  const auto defaults = test::fields_of(LookDesc{});
  const auto after = test::fields_of(look);
  for (size_t i = 0; i < after.size(); ++i) {
    ASSERT_NE(after[i].second, before[i].second) << after[i].first;
    ASSERT_NE(after[i].second, defaults[i].second) << after[i].first;
  }
  start_feeding();
  States decoded;
  auto strands = join();
  auto frames = join(StreamMode::Frames);
  ASSERT_TRUE(strands && frames);
  strands->set_snapshot_listener([&](const auto& snapshot) {
    if (strands->quality().stream_id == 0) decoded[snapshot->tick] = snapshot;
  });
  ASSERT_TRUE(pump_until({strands.get(), frames.get()}, [&] { return frames->image_count() >= 2; }));
  const auto asset = strands->shared_asset();
  ASSERT_EQ(run_command(ctl_target(), SetParameter{assignment_of(look)}), kDoneExit);
  const auto pictures = [&] {
    std::vector<Painted> common;
    for (Painted& painted : observer_.painted())
      if (painted.look == look && decoded.contains(painted.tick)) common.push_back(std::move(painted));
    return common;
  };
  ASSERT_TRUE(pump_until({strands.get(), frames.get()}, [&] {
    return strands->look().look == look && frames->look().look == look && pictures().size() >= 3;
  }));
  EXPECT_EQ(strands->shared_asset(), asset) << "no new asset";
  EXPECT_EQ(strands->replay().stats().keyframe_requests, 0u);
  EXPECT_EQ(strands->blank_pictures() + frames->blank_pictures(), 0u);

  // A client that was there before the change: its renderer goes on with the look that it was told.
  const auto device = RenderDevice::open({});
  ASSERT_TRUE(device) << device.error().to_string();
  auto renderer = (*device)->make_renderer(*asset, sample_look());
  ASSERT_TRUE(renderer) << renderer.error().to_string();
  ASSERT_TRUE((*renderer)->set_look(strands->look().look));
  StrandFill fill;
  for (const Painted& server : pictures()) {
    ASSERT_TRUE((*renderer)->draw(posed_strands_of(*decoded.at(server.tick), fill), server.view.camera,
                                  server.view.size));
    EXPECT_TRUE((*renderer)->read_image() == server.image) << "tick " << server.tick;
  }
}

TEST_F(EndToEnd, EverybodySeesTheNewestLookWhoeverChangedItAndWhoeverJoinsLater) {
  start_feeding();
  auto one = join(StreamMode::Strands, Role::Controller);
  auto other = join(StreamMode::Strands, Role::Controller);
  ASSERT_TRUE(one && other);
  ASSERT_TRUE(pump_until({one.get(), other.get()},
                         [&] { return one->decoded_frames() >= 5 && other->decoded_frames() >= 5; }));
  const uint64_t keyframes = one->replay().stats().keyframes;
  // Two at once: fields are independent, and of one field the last change counts.
  const auto set = [&](ViewerSession& by, const std::string& assignment) {
    ASSERT_TRUE(by.client().send(SetParameter{assignment}));
    ASSERT_TRUE(pump_until({one.get(), other.get()}, [&] {
      const auto notices = by.take_notices();
      return !notices.empty() && !notices.back().is_error;
    }));
  };
  LookChange expected{sample_look(), sample_camera()};
  for (int i = 0; i < 3; ++i) {
    ASSERT_NO_FATAL_FAILURE(set(*one, "look.hair_color=black"));
    ASSERT_NO_FATAL_FAILURE(set(*other, "look.shading.wetness=0.875"));
    ASSERT_NO_FATAL_FAILURE(set(*one, "camera.fov_y_rad=0.875"));
    ASSERT_NO_FATAL_FAILURE(set(*other, "look.hair_color=grey"));
  }
  expected.look.hair_color = "grey";
  expected.look.shading.wetness = 0.875f;
  expected.camera.fov_y_rad = 0.875f;
  ASSERT_TRUE(pump_until({one.get(), other.get()},
                         [&] { return one->look() == expected && other->look() == expected; }));
  EXPECT_GE(one->look_changes(), 1u);
  EXPECT_EQ(one->replay().stats().keyframes, keyframes) << "no keyframe";
  EXPECT_EQ(one->replay().stats().rejected_frames, 0u);

  // Strands go back to rest; the look is none of theirs.
  ASSERT_TRUE(one->client().send(ControlCommand{Command::Reset}));
  ASSERT_TRUE(pump_until({one.get(), other.get()}, [&] { return !one->take_notices().empty(); }));
  auto late = join(StreamMode::Frames);
  ASSERT_TRUE(late);
  EXPECT_EQ(late->welcome().look, expected.look);
  EXPECT_EQ(late->welcome().camera, expected.camera);
  ASSERT_TRUE(pump_until({late.get()}, [&] { return late->image_count() >= 1; }));
  EXPECT_EQ(observer_.painted().back().look, expected.look);
  EXPECT_EQ(observer_.painted().back().view.camera, expected.camera);
  EXPECT_EQ(late->look_changes(), 0u);

  // Whoever is refused changes nothing for anybody.
  const uint64_t changes = other->look_changes();
  ASSERT_TRUE(one->client().send(SetParameter{"look.light_direction={ x: 0 y: 0 z: 0 }"}));
  ASSERT_TRUE(pump_until({one.get(), other.get()}, [&] {
    const auto notices = one->take_notices();
    return !notices.empty() && notices.back().is_error;
  }));
  EXPECT_EQ(other->look_changes(), changes);
  EXPECT_EQ(other->look(), expected);
}

// What was changed while it ran is what starts again from the file.
TEST_F(EndToEnd, TheSceneIsSavedAsItRuns) {
  const CtlTarget target = ctl_target();
  ASSERT_EQ(run_command(target, SetParameter{assignment_of(second_sample_look())}), kDoneExit);
  ASSERT_EQ(run_command(target, SetParameter{"wind.mean_mps.x=3"}), kDoneExit);
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "kept" / "scene.textproto";
  ASSERT_EQ(run_save(target, file), kDoneExit);
  const auto saved = load_scene(file, {});
  ASSERT_TRUE(saved) << saved.error().to_string();
  SceneDesc expected = test::small_scene(kStrands, kVertices);
  expected.look = second_sample_look();
  expected.camera = sample_camera();
  expected.stream.frame_width = 96;
  expected.stream.frame_height = 64;
  expected.wind.mean_mps.x = 3.0f;
  EXPECT_EQ(*saved, expected) << to_text(*saved);
  EXPECT_EQ(run_save(target, folder.path() / "kept"), kBadInputExit) << "a folder is no file";
}

TEST_F(EndToEnd, AControllerPausesStepsAndIsToldWhatIsWrong) {
  auto viewer = join(StreamMode::Strands, Role::Controller);
  ASSERT_TRUE(viewer);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->decoded_frames() >= 3; }));
  ASSERT_TRUE(viewer->client().send(ControlCommand{Command::Pause}));
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->status().is_paused; }));
  // The status may overtake frames that are on their way: wait until none has come for a while.
  uint64_t tick = 0;
  for (int quiet = 0; quiet < 10; ++quiet) {
    ASSERT_TRUE(viewer->pump(kWait));
    if (std::exchange(tick, viewer->replay().newest()->tick) != tick) quiet = 0;
  }
  ASSERT_TRUE(viewer->client().send(ControlCommand{Command::StepOnce}));
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->replay().newest()->tick != tick; }));
  EXPECT_EQ(viewer->replay().newest()->tick, tick + 1);

  const CtlTarget target = ctl_target();
  EXPECT_EQ(run_command(target, ControlCommand{Command::Resume}), kDoneExit);
  EXPECT_EQ(run_command(target, SetParameter{"solver.name=spaghetti"}), kRefusedExit);
  EXPECT_EQ(run_health(target), kDoneExit);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->replay().newest()->tick > tick + 5; }));
}

/// One viewer of strands that move, while somebody sets the stream.
// The strands go on without a gap, by what the viewer can afford of what is simulated now.
TEST_F(EndToEnd, AViewerThatCanNoLongerPredictGetsTheFallbackAndComesBack) {
  start_feeding();
  ASSERT_TRUE(eventually([&] { return server_->counters().sim.step_cost > 0.0; }));
  const SimStats sim = server_->counters().sim;
  ClientConfig config = client_config();
  config.hello.step_ns =  // half of what it may take
      0.5 * kPredictionShare * 1e9 / (kStrands * kVertices * 60.0 * sim.substeps * sim.step_cost);
  const auto viewer = open(config);
  ASSERT_TRUE(viewer);
  States states;
  record(*viewer, states);
  const auto follows = [&](const std::string& codec, size_t number) {
    return pump_until({viewer.get()}, [&] {
      return viewer->welcome().codec == codec &&
             strand_stream_of(viewer->replay().stream_id()).codec == number;
    });
  };
  ASSERT_TRUE(follows("step", 0));
  const uint32_t substeps[] = {sim.substeps * 4, sim.substeps};
  for (const size_t turn : {0, 1}) {
    const size_t count = states.size();
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return states.size() >= count + 10; }));
    ASSERT_EQ(run_command(ctl_target(), SetParameter{fmt::format("substeps={}", substeps[turn])}), kDoneExit);
    ASSERT_TRUE(turn == 0 ? follows("tangent", 1) : follows("step", 0)) << turn;
    EXPECT_THAT(viewer->welcome().codec_reason, HasSubstr(turn == 0 ? "100 % of a core" : "step: "));
  }
  const size_t count = states.size();
  ASSERT_TRUE(pump_until({viewer.get()}, [&] { return states.size() >= count + 10; }));
  expect_within_bound(states, observer_.published(), viewer->welcome().bound_m);
  EXPECT_EQ(server_->counters().net.codec_changes, 2u);
  EXPECT_EQ(viewer->blank_pictures(), 0u);
  EXPECT_EQ(viewer->replay().stats().rejected_frames, 0u) << viewer->replay().stats().last_error;
}

class StreamSettings : public EndToEnd {
 protected:
  void SetUp() override {
    EndToEnd::SetUp();
    if (server_ == nullptr) return;
    start_feeding();
    viewer_ = join();
    ASSERT_TRUE(viewer_);
    record(*viewer_, states_);
    ASSERT_TRUE(pump_until([&] { return states_.size() >= 5; }));
  }
  template <class Condition>
  [[nodiscard]] bool pump_until(Condition condition) {
    return ServerFixture::pump_until({viewer_.get()}, condition);
  }
  /// The command waits for its answer, which needs nobody to pump this viewer; then the viewer is told.
  void set(const std::string& assignment) {
    const uint64_t changes = viewer_->quality_changes();
    ASSERT_EQ(run_command(ctl_target(), SetParameter{assignment}), kDoneExit) << assignment;
    ASSERT_TRUE(pump_until([&] { return viewer_->quality_changes() > changes; })) << assignment;
    EXPECT_THAT(viewer_->quality().reason, HasSubstr("changed"));
  }
  void expect_one_chain() const {
    EXPECT_EQ(viewer_->replay().stats().rejected_frames, 0u) << viewer_->replay().stats().last_error;
    EXPECT_EQ(viewer_->replay().stats().keyframe_requests, 0u) << "a keyframe comes by itself";
  }

  std::unique_ptr<ViewerSession> viewer_;
  States states_;
};

// The bound on a running server: announced, then a keyframe on the new lattice, and everybody goes on.
TEST_F(StreamSettings, TheBoundChangesWhileViewersWatch) {
  for (const float bound_m : {4e-4f, 2e-5f, 1e-4f}) {
    ASSERT_NO_FATAL_FAILURE(set(fmt::format("stream.bound_m={}", bound_m)));
    EXPECT_EQ(viewer_->quality().bound_m, bound_m);
    const float quantum_m = lattice_step_m(viewer_->welcome().codec, bound_m).value();
    States changed;
    ASSERT_TRUE(pump_until([&] {
      changed.clear();
      for (const auto& item : states_)
        if (item.second->quantum_m == quantum_m) changed.insert(item);
      return changed.size() >= 20;
    }));
    // The first state may share its step with one on the old lattice.
    changed.erase(changed.begin());
    expect_within_bound(changed, observer_.published(), bound_m);
    auto late = join();
    ASSERT_TRUE(late);
    EXPECT_EQ(late->welcome().bound_m, bound_m);
    states_.clear();
  }
  expect_one_chain();
}

/// How many states in a row are each of another group of `group` steps than the one before.
size_t longest_run_of_groups(const States& states, uint64_t group) {
  size_t run = 0, longest = 0;
  for (auto state = states.begin(); state != states.end(); ++state) {
    const bool is_other = state == states.begin() || state->first / group != std::prev(state)->first / group;
    run = is_other ? run + 1 : 0;
    longest = std::max(longest, run);
  }
  return longest;
}

// Likewise the rate, which needs no keyframe: states are left out and the chain goes on.
TEST_F(StreamSettings, TheRateChangesWhileViewersWatch) {
  const double step_rate_hz = viewer_->welcome().step_rate_hz;
  for (const uint32_t divisor : {3u, 6u, 1u}) {
    ASSERT_NO_FATAL_FAILURE(set(fmt::format("stream.strand_rate_hz={}", step_rate_hz / divisor)));
    EXPECT_EQ(viewer_->quality().rate_divisor, divisor);
    // One state of each group of so many steps. Keyframes for those who join, and states that were waited for
    // too long, come besides.
    states_.clear();
    ASSERT_TRUE(pump_until([&] { return longest_run_of_groups(states_, divisor) >= 8; })) << divisor;
    expect_within_bound(states_, observer_.published(), viewer_->welcome().bound_m);
    auto late = join();
    ASSERT_TRUE(late);
    ASSERT_TRUE(ServerFixture::pump_until({viewer_.get(), late.get()}, [&] {
      return divisor == 1 || late->quality().rate_divisor == divisor;
    })) << "who joins later is told as well";
  }
  expect_one_chain();
}

TEST_F(EndToEnd, TheCheckCommandComparesTwoViewers) {
  // What the scene is served by, and what those get that cannot predict.
  for (const auto& [step_ns, codec] : {std::pair{1e-3, "step"}, {0.0, "tangent"}}) {
    ClientConfig config = client_config();
    config.hello.step_ns = step_ns;
    const auto check = check_stream(config, 40, kDeadlineS);
    ASSERT_TRUE(check) << check.error().to_string();
    EXPECT_TRUE(check->is_good()) << check->to_string();
    EXPECT_GE(check->decoded_frames, 40u);
    EXPECT_THAT(check->to_string(), HasSubstr(fmt::format("frames decoded by {}, ", codec)));
  }
}

TEST_F(EndToEnd, TheHeadlessViewerLeavesPictureClipAndReport) {
  start_feeding();
  const TemporaryFolder folder;
  ViewOptions options;
  options.address = {"127.0.0.1", server_->port()};
  options.mode = StreamMode::Strands;
  options.is_headless = true;
  options.size = {120, 80};
  options.clip_size = {64, 48};
  options.screenshot = folder.path() / "hair.png";
  options.after_frames = 20;
  options.clip = folder.path() / "hair.webp";
  options.clip_s = 0.5;
  options.clip_fps = 10.0;
  const std::atomic<bool> stop{false};
  const auto report = run_headless(options, stop);
  ASSERT_TRUE(report) << report.error().to_string();
  const auto png = load_png(options.screenshot);
  ASSERT_TRUE(png) << png.error().to_string();
  EXPECT_EQ(png->width, 120u);
  EXPECT_GT(std::filesystem::file_size(options.clip), 100u);
  const std::string lines = to_lines(*report);
  EXPECT_THAT(lines, HasSubstr("rendered_pictures=6\n")) << "five of the clip and the picture";
  EXPECT_THAT(lines, HasSubstr("strands=150\n"));
  EXPECT_THAT(lines, HasSubstr("hair_color=red\n"));
  EXPECT_THAT(lines, HasSubstr("look_changes=0\n"));
  EXPECT_THAT(to_json(*report), HasSubstr("\"mode\": \"strands\""));
}

// It has no view of its own: the server's pictures for it are taken from where the scene's camera is.
TEST_F(EndToEnd, TheHeadlessViewerGoesAlongWithLookAndCameraOfTheScene) {
  const TemporaryFolder folder;
  ViewOptions options;
  options.address = {"127.0.0.1", server_->port()};
  options.mode = StreamMode::Frames;
  options.is_headless = true;
  options.size = {96, 64};
  options.seconds = kDeadlineS;
  std::atomic<bool> stop{false};
  std::optional<Result<ViewReport>> report;
  std::thread viewer([&] { report = run_headless(options, stop); });
  const auto is_seen = [&](auto&& is_it) {
    return eventually([&] {
      const auto painted = observer_.painted();
      return !painted.empty() && is_it(painted.back());
    });
  };
  EXPECT_TRUE(is_seen([](const Painted& painted) { return painted.view.camera == sample_camera(); }));
  EXPECT_EQ(run_command(ctl_target(), SetParameter{"camera.fov_y_rad=0.5"}), kDoneExit);
  EXPECT_EQ(run_command(ctl_target(), SetParameter{"look.hair_color=grey"}), kDoneExit);
  EXPECT_TRUE(is_seen([](const Painted& painted) {
    return painted.view.camera.fov_y_rad == 0.5f && painted.look.hair_color == "grey";
  }));
  stop = true;
  viewer.join();
  ASSERT_TRUE(report && *report) << (*report).error().to_string();
  EXPECT_THAT(to_lines(**report), HasSubstr("hair_color=grey\n"));
}

TEST_F(EndToEnd, AStoppedServerTellsItsViewers) {
  auto viewer = join();
  ASSERT_TRUE(viewer);
  server_->stop();
  Status pumped;
  while (pumped) pumped = viewer->pump(kWait);
  EXPECT_EQ(pumped.error().code, ErrorCode::Unavailable) << "a viewer may come back when the server does";
  EXPECT_THAT(pumped.error().message, HasSubstr("stopping"));
}

/// The window under a virtual display, as a person starts it: what its report says. It is given more time, up
/// to a bound, while the report has this line, which says that it came to nothing yet on a busy machine.
std::string window_report(uint16_t port, const std::string& environment, const std::string& options,
                          const std::string& nothing_yet) {
  const TemporaryFolder folder;
  const auto report = folder.path() / "report.txt";
  std::string text = nothing_yet;
  for (int seconds = 4; seconds <= 64 && text.find(nothing_yet) != std::string::npos; seconds *= 2) {
    // The driver's libraries keep memory by their own globals, and are unloaded: that is no leak of the
    // window's.
    const std::string command = fmt::format(
        "ASAN_OPTIONS=detect_leaks=0 {} xvfb-run -a -s '-screen 0 320x240x24' {} --connect 127.0.0.1:{} "
        "--size 160x120 --seconds {} {} --report {} >{} 2>&1",
        environment, STRANDCAST_VIEW_PROGRAM, port, seconds, options, report.string(),
        (folder.path() / "log").string());
    const int status = std::system(command.c_str());
    const auto log = load_text(folder.path() / "log", 1u << 20);
    EXPECT_EQ(status, 0) << (log ? *log : "no output");
    const auto lines = load_text(report, 1u << 20);
    EXPECT_TRUE(lines) << lines.error().to_string();
    if (status != 0 || !lines) return {};
    text = *lines;
  }
  return text;
}

bool has_virtual_display() {
  return std::system("command -v xvfb-run >/dev/null") == 0;
}

TEST_F(EndToEnd, TheWindowOpensDrawsAndLeaves) {
  if (!has_virtual_display())
    GTEST_SKIP() << "xvfb-run (package xvfb) is not installed: no display to open a window on";
  const std::string nothing = "interpolation=none\n";
  const std::string report = window_report(server_->port(), "", "--playout smooth", nothing);
  EXPECT_THAT(report, HasSubstr("interpolation="));
  EXPECT_EQ(report.find(nothing), std::string::npos) << report;
}

/// A driver with OpenGL 3.3 can show pictures, and those of strands are drawn without it.
TEST_F(EndToEnd, AWindowWithoutOpenGl45DrawsStrandsOnTheProcessor) {
  if (!has_virtual_display())
    GTEST_SKIP() << "xvfb-run (package xvfb) is not installed: no display to open a window on";
  const std::string nothing = "rendered_pictures=0\n";
  const std::string report =
      window_report(server_->port(), "MESA_GL_VERSION_OVERRIDE=3.3", "--mode strands", nothing);
  EXPECT_THAT(report, HasSubstr("mode=strands\n"));
  EXPECT_EQ(report.find(nothing), std::string::npos) << report;
}

/// Who insists on OpenGL and has not got it is shown the server's pictures.
TEST_F(EndToEnd, AWindowThatInsistsOnOpenGl45AsksForTheServersPictures) {
  if (!has_virtual_display())
    GTEST_SKIP() << "xvfb-run (package xvfb) is not installed: no display to open a window on";
  const std::string nothing = "decoded_frames=0\n";
  const std::string report =
      window_report(server_->port(), "MESA_GL_VERSION_OVERRIDE=3.3", "--renderer gl", nothing);
  EXPECT_THAT(report, HasSubstr("mode=frames\n"));
  EXPECT_THAT(report, HasSubstr("no OpenGL 4.5"));
  EXPECT_THAT(report, HasSubstr("blank_pictures=0\n"));
  EXPECT_EQ(report.find(nothing), std::string::npos) << report;
}

TEST_F(EndToEnd, ADiagnosisWithoutADisplayFindsThatASessionWouldWork) {
  const TemporaryFolder folder;
  start_feeding();
  const std::string command =
      fmt::format("env -u DISPLAY -u WAYLAND_DISPLAY {} --diagnose 127.0.0.1:{} >{} 2>&1",
                  STRANDCAST_VIEW_PROGRAM, server_->port(), (folder.path() / "log").string());
  const int status = std::system(command.c_str());
  const auto log = load_text(folder.path() / "log", 1u << 20);
  ASSERT_TRUE(log) << log.error().to_string();
  EXPECT_EQ(WEXITSTATUS(status), 0) << *log;
  for (const char* part :
       {"drawing", "note     display", "ok       decoders", "ok       server", "ok       role",
        "ok       stream", "ok       clock", "link", "a session would work\n"})
    EXPECT_THAT(*log, HasSubstr(part));
}

TEST_F(EndToEnd, WithoutADisplayTheErrorNamesTheWayOut) {
  const TemporaryFolder folder;
  const std::string command =
      fmt::format("env -u DISPLAY -u WAYLAND_DISPLAY {} --connect 127.0.0.1:{} >{} 2>&1",
                  STRANDCAST_VIEW_PROGRAM, server_->port(), (folder.path() / "log").string());
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  const auto log = load_text(folder.path() / "log", 1u << 20);
  ASSERT_TRUE(log);
  EXPECT_THAT(*log, HasSubstr("--headless"));
}

}  // namespace
}  // namespace strandcast::end_to_end_test
