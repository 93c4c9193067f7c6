// Who watches what, and the command line of the server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/units.h"
#include "common/base/version.h"
#include "common/groom/groom_asset.h"
#include "common/scene/scene_file.h"
#include "server/app/codec_choice.h"
#include "server/app/live_manager.h"
#include "server/app/options.h"
#include "server/app/server_metrics.h"
#include "server/app/session_manager.h"
#include "server/app/slow_motion.h"
#include "server/app/viewers.h"
#include "server/sim/solver_registry.h"
#include "server/source/scene_change.h"
#include "server/stream/demand_book.h"
#include "tests/support/metrics_text.h"

namespace strandcast::server_app_test {
namespace {

using testing::HasSubstr;

Hello hello(Role role, StreamMode mode, uint32_t width = 0, uint32_t height = 0) {
  Hello message;
  message.role = role;
  message.mode = mode;
  message.frame_width = width;
  message.frame_height = height;
  return message;
}

/// Viewers of a scene, and what they want of the stream.
class Viewing {
 public:
  explicit Viewing(const PictureBudget& budget = kHardwareBudget)
      : book(make_scene_view(scene_, scene_picture_size(scene_), PictureCodecs{0}), budget),
        viewers(scene_, book) {}
  Result<Viewers::Place> add(SessionId session, const Hello& hello, const std::string& peer = "10.0.0.1") {
    subscriptions[session].begin(hello);
    return viewers.add(session, book.add({peer, hello.role == Role::Controller}), subscriptions[session],
                       hello);
  }
  void remove(SessionId session) { book.remove(viewers.remove(session)); }
  /// The session has got the first frame of the next mode.
  void finish_change(SessionId session, int64_t time_ns) {
    subscriptions[session].finish_change();
    viewers.note_mode(session, time_ns);
  }
  RuntimeFacts facts() const { return book.total().facts; }

 private:
  const SceneDesc scene_ = built_in_scene();

 public:
  DemandBook book;
  std::map<SessionId, Subscription> subscriptions;
  Viewers viewers;
};

TEST(Viewers, CountsByModeAndSharesEqualPictures) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  const auto automatic = viewing.add(1, hello(Role::Viewer, StreamMode::Auto));
  ASSERT_TRUE(automatic.ok());
  EXPECT_EQ(viewing.subscriptions[1].mode(), StreamMode::Strands);
  EXPECT_FALSE(automatic->reason.empty());
  ASSERT_TRUE(viewing.add(2, hello(Role::Source, StreamMode::Frames)).ok());
  const auto first = viewing.add(3, hello(Role::Viewer, StreamMode::Frames));
  const auto second = viewing.add(4, hello(Role::Controller, StreamMode::Frames));
  ASSERT_TRUE(first.ok() && second.ok());
  const auto class_of = [&](SessionId session) {
    return viewing.subscriptions[session].pictures.picture_class;
  };
  const PictureClass shared = class_of(3);
  EXPECT_EQ(class_of(4), shared);
  EXPECT_EQ(viewing.facts().strand_viewers, 1u);
  EXPECT_EQ(viewing.facts().frame_viewers, 2u);
  EXPECT_EQ(viewers.viewer_count(), 3u) << "a source watches nothing";
  EXPECT_EQ(viewing.book.picture_views().size(), 1u);

  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 2.0f};
  ASSERT_TRUE(viewers.set_camera(4, camera).ok());
  EXPECT_NE(class_of(4), shared);
  EXPECT_TRUE(viewers.set_camera(1, camera).ok());
  EXPECT_EQ(class_of(1), 0u) << "a viewer of strands has no picture, but its camera is remembered";
  EXPECT_FALSE(viewers.set_camera(2, camera).ok()) << "a source has none";
  for (SessionId session = 1; session <= 4; ++session) viewing.remove(session);
  EXPECT_EQ(viewing.facts().strand_viewers + viewing.facts().frame_viewers, 0u);
  EXPECT_TRUE(viewing.book.picture_views().empty());
}

TEST(Viewers, AViewerGetsTheBestCodecItDecodes) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  Hello message = hello(Role::Viewer, StreamMode::Frames);
  const auto codec_for = [&](PictureCodecs decodable) {
    message.picture_codecs = decodable;
    viewing.remove(1);
    EXPECT_TRUE(viewing.add(1, message).ok());
    return viewers.pictures(1)->view.codec;
  };
  EXPECT_EQ(codec_for(0), PictureCodec::Jpeg) << "a client of before";
  EXPECT_EQ(codec_for(codec_bit(PictureCodec::JpegTiles)), PictureCodec::JpegTiles);
  EXPECT_EQ(codec_for(kAllPictureCodecs & ~codec_bit(PictureCodec::H264)), PictureCodec::Vp8);
  const bool has_h264 = (encodable_picture_codecs() & codec_bit(PictureCodec::H264)) != 0;
  EXPECT_EQ(codec_for(kAllPictureCodecs), has_h264 ? PictureCodec::H264 : PictureCodec::Vp8);
  EXPECT_EQ(codec_for(codec_bit(PictureCodec::H264)), has_h264 ? PictureCodec::H264 : PictureCodec::Jpeg);
  message.frame_width = 642;
  EXPECT_EQ(codec_for(kAllPictureCodecs), PictureCodec::Vp8) << "half of it would be odd";
  EXPECT_EQ(codec_for(~kAllPictureCodecs), PictureCodec::Jpeg) << "bits of a later version";
}

TEST(Viewers, AStepOfTheLadderConcernsItsViewerOnly) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  const auto first = viewing.add(1, hello(Role::Viewer, StreamMode::Frames, 640, 360));
  const auto second = viewing.add(2, hello(Role::Viewer, StreamMode::Frames, 640, 360));
  ASSERT_TRUE(first.ok() && second.ok());
  const auto class_of = [&](SessionId session) {
    return viewing.subscriptions[session].pictures.picture_class;
  };
  const PictureChoice begun = viewing.subscriptions[1].pictures;
  ASSERT_EQ(class_of(2), begun.picture_class);
  EXPECT_EQ(viewers.pictures(1)->view.quality, 80) << "the scene's";
  const size_t last = begun.costs.size() - 1;
  const auto slow = viewers.set_picture_step(2, last);
  ASSERT_TRUE(slow.ok());
  EXPECT_NE(slow->picture_class, begun.picture_class);
  EXPECT_EQ(class_of(2), slow->picture_class);
  EXPECT_EQ(viewing.subscriptions[2].pictures.step, last);
  EXPECT_EQ(slow->view.size.width, 320u);
  EXPECT_EQ(slow->view.rate_divisor, 2u);
  EXPECT_EQ(slow->view.quality, 30);
  EXPECT_EQ(viewers.pictures(1)->view.size.width, 640u);
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 2.0f};
  ASSERT_TRUE(viewers.set_camera(2, camera).ok());
  EXPECT_EQ(viewers.pictures(2)->view.size.width, 320u) << "the camera is no reason for more";
  ASSERT_TRUE(viewers.set_camera(2, viewers.pictures(1)->view.camera).ok());
  const auto back = viewers.set_picture_step(2, begun.step);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->picture_class, begun.picture_class) << "one encode for both again";
  EXPECT_FALSE(viewers.set_picture_step(2, last + 1).ok());
  EXPECT_FALSE(viewers.set_picture_step(3, 0).ok());
}

TEST(Viewers, AWindowChangesTheSizeAtAnyStepOfTheLadder) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  Hello message = hello(Role::Viewer, StreamMode::Frames, 640, 360);
  message.picture_codecs = kAllPictureCodecs;
  ASSERT_TRUE(viewing.add(1, message).ok());
  const PictureClass own = viewing.subscriptions[1].pictures.picture_class;
  const size_t last = viewing.subscriptions[1].pictures.costs.size() - 1;
  ASSERT_TRUE(viewers.set_window(1, {406, 720, false}).ok());
  const RenderSize size = viewers.pictures(1)->view.size;
  const bool is_h264 = viewers.pictures(1)->view.codec == PictureCodec::H264;
  EXPECT_EQ(size.width, is_h264 ? 404u : 406u) << "H.264 halves even sides";
  EXPECT_EQ(size.height, 720u);
  EXPECT_EQ(viewing.subscriptions[1].pictures.picture_class, own) << "alone in its class";
  ASSERT_TRUE(viewers.set_picture_step(1, last).ok());
  EXPECT_EQ(viewers.pictures(1)->view.size.height, 360u);
  ASSERT_TRUE(viewers.set_window(1, {0, 400, false}).ok());
  EXPECT_EQ(viewers.pictures(1)->view.size.width, size.width / 2) << "a side that is not said stays";
  EXPECT_EQ(viewers.pictures(1)->view.size.height, 200u);
  ASSERT_TRUE(viewing.add(2, hello(Role::Source, StreamMode::Frames)).ok());
  EXPECT_FALSE(viewers.set_window(2, {64, 64, false}).ok()) << "a source has none";
}

TEST(Viewers, AHiddenWindowWantsNothingAndGivesUpItsChange) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  ASSERT_TRUE(viewing.add(1, hello(Role::Viewer, StreamMode::Strands)).ok());
  ASSERT_TRUE(viewing.add(2, hello(Role::Viewer, StreamMode::Frames, 320, 200)).ok());
  for (const SessionId session : {1, 2}) ASSERT_TRUE(viewers.set_window(session, {0, 0, true}).ok());
  EXPECT_EQ(viewing.facts().strand_viewers + viewing.facts().frame_viewers, 0u);
  EXPECT_TRUE(viewing.book.picture_views().empty()) << "its place is for others";
  EXPECT_EQ(viewers.viewer_count(), 2u) << "it is there all the same";
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 2.0f};
  ASSERT_TRUE(viewers.set_camera(2, camera).ok());
  for (const SessionId session : {1, 2}) ASSERT_TRUE(viewers.set_window(session, {}).ok());
  EXPECT_EQ(viewing.facts().strand_viewers, 1u);
  EXPECT_EQ(viewing.book.picture_views().begin()->second.camera, camera) << "as it was moved meanwhile";

  viewing.subscriptions[1].begin_change(StreamMode::Frames, 0);
  ASSERT_TRUE(viewers.set_window(1, {0, 0, true}).ok());
  EXPECT_FALSE(viewing.subscriptions[1].next());
  // Others have taken the places meanwhile: it stays hidden.
  Viewing full;
  ASSERT_TRUE(full.add(1, hello(Role::Viewer, StreamMode::Frames, 100, 100)).ok());
  ASSERT_TRUE(full.viewers.set_window(1, {0, 0, true}).ok());
  for (uint32_t i = 0; i + 1 < kMaxPictureViews; ++i)
    ASSERT_TRUE(
        full.add(10 + i, hello(Role::Viewer, StreamMode::Frames, 64 + i, 64), std::to_string(i)).ok());
  EXPECT_FALSE(full.viewers.set_window(1, {}).ok());
  EXPECT_TRUE(full.viewers.is_hidden(1));
}

/// Takes every place for pictures of their own that there is, from as many addresses as needed.
void fill(Viewing& viewing) {
  for (uint32_t i = 0; i + 1 < kMaxPictureViews; ++i)
    ASSERT_TRUE(
        viewing.add(10 + i, hello(Role::Viewer, StreamMode::Frames, 64 + i, 64), std::to_string(i)).ok());
}

TEST(Viewers, RefusesPicturesBeyondTheLimitForNowAndKeepsThePictureOfTheScene) {
  Viewing viewing;
  ASSERT_NO_FATAL_FAILURE(fill(viewing));
  const auto refused = viewing.add(100, hello(Role::Viewer, StreamMode::Frames, 512, 512), "late");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::Unavailable) << "later there may be room";
  EXPECT_EQ(viewing.add(101, hello(Role::Viewer, StreamMode::Frames, 1'000'000, 2)).error().code,
            ErrorCode::BadInput);
  EXPECT_EQ(viewing.facts().frame_viewers, kMaxPictureViews - 1);
  for (const PictureCodec codec : kPictureCodecs) {
    Hello late = hello(Role::Viewer, StreamMode::Frames);
    late.picture_codecs = codec_bit(codec);
    EXPECT_TRUE(viewing.add(200 + static_cast<SessionId>(codec), late, "late").ok()) << to_string(codec);
  }
}

TEST(Viewers, AControllerFindsPixelsThatViewersCannotTake) {
  Viewing viewing;
  const auto large = [&](SessionId session, Role role, const std::string& peer) {
    return viewing.add(
        session, hello(role, StreamMode::Frames, 1920 + 4 * static_cast<uint32_t>(session), 1080), peer);
  };
  SessionId session = 0;
  while (session < kMaxPictureViews && large(session, Role::Viewer, std::to_string(session)).ok()) ++session;
  const auto refused = large(session, Role::Viewer, "late");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("million pixels"));
  EXPECT_TRUE(large(session, Role::Controller, "late").ok());
}

TEST(Viewers, WithoutAGpuALargePictureIsDrawnSmallerAndThatIsSaid) {
  Viewing viewing(kSoftwareBudget);
  Hello large = hello(Role::Viewer, StreamMode::Frames, 3840, 2160);
  large.picture_codecs = kAllPictureCodecs;
  const auto place = viewing.add(1, large);
  ASSERT_TRUE(place.ok()) << place.error().to_string();
  EXPECT_EQ(place->size.width, 1280u);
  EXPECT_EQ(place->size.height, 720u);
  EXPECT_THAT(place->reason, HasSubstr("without a GPU this server draws 1280 x 720 instead of 3840 x 2160"));
  EXPECT_EQ(viewing.viewers.picture_size(1).width, 1280u);
  EXPECT_EQ(viewing.book.picture_views().begin()->second.size.width, 1280u);
  // And half of that at the last step of its ladder.
  ASSERT_TRUE(viewing.viewers.set_picture_step(1, viewing.subscriptions[1].pictures.costs.size() - 1));
  EXPECT_EQ(viewing.viewers.picture_size(1).width, 640u);
  // On a GPU all is drawn as it is asked for.
  Viewing fast(kHardwareBudget);
  const auto whole = fast.add(1, large);
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->size.width, 3840u);
  EXPECT_EQ(whole->reason, "pictures were asked for");
}

/// Facts under which both modes work and strands are the better ones.
ModeFacts good_facts() {
  ModeFacts facts;
  facts.strand_classes = {{500e3, 60.0}, {120e3, 10.0}};
  facts.paint_ms = 20.0;
  facts.picture_bytes = 10e3;
  return facts;
}
constexpr int64_t kTick = 250'000'000;

TEST(Viewers, APersonSwitchesAtMostOnceASecondAndIsAlwaysAnswered) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  ASSERT_TRUE(viewing.add(1, hello(Role::Viewer, StreamMode::Strands, 64, 64)).ok());
  int64_t time_ns = 1'000 * kTick;
  EXPECT_FALSE(viewers.consider(1, good_facts(), time_ns)) << "nothing was asked for";
  viewers.request_mode(1, StreamMode::Frames);
  const auto change = viewers.consider(1, good_facts(), time_ns);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->mode, StreamMode::Frames);
  EXPECT_THAT(change->reason, HasSubstr("asked for"));
  EXPECT_EQ(change->frame_width, 64u);
  EXPECT_NE(viewing.subscriptions[1].pictures.picture_class, 0u);
  EXPECT_EQ(viewing.subscriptions[1].mode(), StreamMode::Strands);
  EXPECT_EQ(viewing.subscriptions[1].next(), StreamMode::Frames);
  EXPECT_EQ(viewing.facts().strand_viewers, 1u) << "strands go on until the first picture";
  EXPECT_EQ(viewing.facts().frame_viewers, 1u);
  EXPECT_EQ(viewers.viewer_count(), 1u) << "and it is one viewer all the time";
  viewing.finish_change(1, time_ns);
  EXPECT_EQ(viewing.facts().strand_viewers, 0u);

  // Three more within a second: none is carried out before the second has passed, then the newest.
  viewers.request_mode(1, StreamMode::Strands);
  viewers.request_mode(1, StreamMode::Frames);
  viewers.request_mode(1, StreamMode::Strands);
  for (int tick = 1; tick < 4; ++tick)
    EXPECT_FALSE(viewers.consider(1, good_facts(), time_ns + tick * kTick)) << tick;
  const auto back = viewers.consider(1, good_facts(), time_ns + 4 * kTick);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->mode, StreamMode::Strands);
  viewing.finish_change(1, time_ns + 4 * kTick);
  EXPECT_TRUE(viewing.book.picture_views().empty());

  // What it has already is answered too.
  viewers.request_mode(1, StreamMode::Auto);
  const auto answer = viewers.consider(1, good_facts(), time_ns + 8 * kTick);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->mode, StreamMode::Strands);
  EXPECT_FALSE(viewers.consider(1, good_facts(), time_ns + 9 * kTick)) << "once";
}

TEST(Viewers, AChangeWithoutAFirstFrameIsGivenUp) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  ASSERT_TRUE(viewing.add(1, hello(Role::Viewer, StreamMode::Auto)).ok());
  viewers.set_report(1, {.device = DrawingDevice::None});
  EXPECT_EQ(viewers.report(1).device, DrawingDevice::None);
  ModeFacts facts = good_facts();
  facts.device = DrawingDevice::None;
  int64_t time_ns = kTick;
  const auto change = viewers.consider(1, facts, time_ns);
  ASSERT_TRUE(change) << "who cannot draw waits for nothing";
  EXPECT_EQ(change->mode, StreamMode::Frames);
  EXPECT_FALSE(viewers.consider(1, facts, time_ns += kModeChangeNs - 1)) << "under way";
  const auto given_up = viewers.consider(1, facts, time_ns += 1);
  ASSERT_TRUE(given_up);
  EXPECT_EQ(given_up->mode, StreamMode::Strands);
  EXPECT_TRUE(viewing.book.picture_views().empty());
  EXPECT_EQ(viewing.facts().frame_viewers, 0u);
  EXPECT_FALSE(viewers.consider(1, facts, time_ns + kTick)) << "not tried again at once";
  EXPECT_TRUE(viewers.consider(1, facts, time_ns + 2 * kFirstDwellNs));
}

TEST(Viewers, FramesThatCannotBeHadAreRefusedWithTheReason) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  ASSERT_NO_FATAL_FAILURE(fill(viewing));
  ASSERT_TRUE(viewing.add(1, hello(Role::Viewer, StreamMode::Strands, 512, 512)).ok());
  viewers.request_mode(1, StreamMode::Frames);
  const auto full = viewers.consider(1, good_facts(), kTick);
  ASSERT_TRUE(full);
  EXPECT_EQ(full->mode, StreamMode::Strands);
  EXPECT_THAT(full->reason, HasSubstr("different pictures"));
  EXPECT_FALSE(viewers.consider(1, good_facts(), 2 * kTick)) << "told once";
  ModeFacts broken = good_facts();
  broken.paint_trouble = "no OpenGL here";
  viewers.request_mode(1, StreamMode::Frames);
  const auto refused = viewers.consider(1, broken, 100 * kTick);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->mode, StreamMode::Strands);
  EXPECT_THAT(refused->reason, HasSubstr("no OpenGL here"));
  // Those who watch frames when drawing fails get strands.
  const auto rescued = viewers.consider(10, broken, 100 * kTick);
  ASSERT_TRUE(rescued);
  EXPECT_EQ(rescued->mode, StreamMode::Strands);
}

TEST(ControlBudget, AControllerHasItsBurstThenItsRateAndOthersHaveTheirs) {
  ControlBudget budget;
  constexpr int64_t kBeginNs = kSInNs;
  const auto count = [&](SessionId session, int64_t time_ns) {
    int taken = 0;
    while (taken < 1'000 && budget.take(session, time_ns)) ++taken;
    return taken;
  };
  EXPECT_EQ(count(1, kBeginNs), static_cast<int>(kControlBurst));
  EXPECT_EQ(count(1, kBeginNs + kSInNs), static_cast<int>(kControlsPerS));
  EXPECT_EQ(count(2, kBeginNs + kSInNs), static_cast<int>(kControlBurst));
  EXPECT_EQ(count(1, kBeginNs + 100 * kSInNs), static_cast<int>(kControlBurst)) << "no more is saved up";
}

TEST(Viewers, IsDescribedForTheLogOnOneLine) {
  Viewing viewing;
  Viewers& viewers = viewing.viewers;
  Hello message = hello(Role::Controller, StreamMode::Strands);
  message.name = "a\u202e\u0085b";
  ASSERT_TRUE(viewing.add(7, message).ok());
  EXPECT_EQ(viewers.describe(7), "session 7 (controller 'a??b')");
}

Result<ServerOptions> parse(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "strandcast-server");
  return parse_options(static_cast<int>(arguments.size()), arguments.data());
}

// Every scene that ships with every row of the table, as somebody would type it.
TEST(ServerOptions, EverySceneTakesEverySolver) {
  const auto folder = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy" / "scenes";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    for (const SolverRow& row : solver_table()) {
      ServerOptions options;
      options.scene_path = entry.path();
      options.overrides = {"solver.name=" + row.name};
      const std::string stem = entry.path().stem().string();
      if (stem == "mohawk" || stem == "sintel") options.overrides.push_back("groom.file.path=some.tfx");
      const auto config = load_config(options);
      ASSERT_TRUE(config.ok()) << stem << ": " << config.error().to_string();
      EXPECT_EQ(config->scene.solver.name, row.name);
      EXPECT_TRUE(check_solver(config->scene)) << stem << ", " << row.name;
    }
  }
}

TEST(ServerOptions, ParametersThatWereTypedAreNotLeftOut) {
  const auto config_for = [](std::vector<std::string> overrides) {
    ServerOptions options;
    options.scene_path =
        std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy/scenes/position_based.textproto";
    options.overrides = std::move(overrides);
    return load_config(options);
  };
  const auto fitted = config_for({"solver.name=dftl", "solver.parameters.s_damping=0.5"});
  ASSERT_TRUE(fitted.ok()) << fitted.error().to_string();
  EXPECT_EQ(fitted->scene.solver.parameters, (std::map<std::string, double>{{"s_damping", 0.5}}));
  const auto unknown = config_for({"solver.name=dftl", "solver.parameters.iterations=7"});
  ASSERT_FALSE(unknown.ok());
  EXPECT_THAT(unknown.error().to_string(), HasSubstr("no parameter 'iterations'"));
  const auto outside = config_for({"solver.name=dftl", "solver.parameters.s_damping=17"});
  ASSERT_FALSE(outside.ok());
  EXPECT_THAT(outside.error().to_string(), HasSubstr("17"));
}

/// The live inputs of a command line, or what it says that is wrong.
Result<std::vector<LiveDesc>> live_of(const std::vector<const char*>& arguments) {
  ASSIGN_OR_RETURN(const ServerOptions options, parse(arguments));
  ASSIGN_OR_RETURN(const ServerConfig config, load_config(options));
  return config.scene.live;
}

TEST(MocapOptions, AreInputsOfTheScene) {
  using Inputs = std::vector<LiveDesc>;
  EXPECT_EQ(live_of({}).value(), Inputs{});
  EXPECT_EQ(live_of({"--mocap", "vmc"}).value(), Inputs{{.protocol = "vmc"}});
  EXPECT_EQ(
      live_of({"--mocap", "opentrack:5000", "--mocap-axes", "ypr-xyz", "--mocap-subject", "Zoe"}).value(),
      (Inputs{{.protocol = "opentrack", .port = 5000, .subject = "Zoe", .axes = "ypr-xyz"}}));
  EXPECT_EQ(live_of({"--mocap", "vmc", "--mocap", "freed:40001", "--set", "live.1.delay_ms=20"}).value(),
            (Inputs{{.protocol = "vmc"}, {.protocol = "freed", .port = 40001, .delay_ms = 20}}));
  EXPECT_EQ(live_of({"--set", "live.0.protocol=vmc", "--set", "live.0.turns_only=true"}).value(),
            (Inputs{{.protocol = "vmc", .turns_only = true}}));
  EXPECT_EQ(live_of({"--mocap", "freed", "--mocap-timecode", "25"}).value(),
            (Inputs{{.protocol = "freed", .axes = "/25"}}));
  EXPECT_EQ(live_of({"--mocap", "vmc", "--mocap", "freed", "--mocap-timecode", "25"}).value(),
            (Inputs{{.protocol = "vmc"}, {.protocol = "freed", .axes = "/25"}}));
  EXPECT_THAT(live_of({"--mocap", "opentrack", "--mocap-timecode", "25"}).error().to_string(),
              HasSubstr("no --mocap names it"));
  for (const char* const to : {"vmc", "vmc://localhost", "vmc://127.0.0.2", "opentrack:39539"})
    EXPECT_THAT(live_of({"--mocap", "vmc", "--send", to}).error().to_string(),
                HasSubstr("where this server hears vmc"))
        << to;
  for (const char* const to : {"vmc:39540", "vmc://10.0.0.5", "opentrack"})
    EXPECT_TRUE(live_of({"--mocap", "vmc", "--send", to})) << to;
  // Those of the command line are instead of the scene's, and what is set is set of them.
  EXPECT_EQ(live_of({"--set", "live.0.turns_only=true", "--mocap", "opentrack"}).value(),
            (Inputs{{.protocol = "opentrack", .turns_only = true}}));
  EXPECT_EQ(
      live_of({"--mocap", "vmc", "--mocap", "freed", "--mocap-scale", "0.01", "--set", "live.1.scale=2"})
          .value(),
      (Inputs{{.protocol = "vmc", .scale = 0.01}, {.protocol = "freed", .scale = 2.0}}));
  EXPECT_EQ(parse_mocap("natnet://10.0.0.5").value(), (LiveDesc{.protocol = "natnet", .host = "10.0.0.5"}));
  EXPECT_EQ(parse_mocap("vrpn://[fd00::2]:3884").value(),
            (LiveDesc{.protocol = "vrpn", .host = "fd00::2", .port = 3884}));
  EXPECT_EQ(parse_mocap("vrpn://[fd00::2]").value(), (LiveDesc{.protocol = "vrpn", .host = "fd00::2"}));
}

TEST(MocapOptions, WhatIsWrongIsOneSentence) {
  const auto sentence = [](const std::vector<const char*>& arguments) {
    const auto live = live_of(arguments);
    return live ? std::string("no error") : live.error().to_string();
  };
  EXPECT_THAT(sentence({"--mocap", "smoke"}), testing::AllOf(HasSubstr("smoke"), HasSubstr("opentrack")));
  for (const char* port : {"vmc:", "vmc:0", "vmc:65536", "vmc:12x", "vmc:-1"})
    EXPECT_THAT(sentence({"--mocap", port}), HasSubstr("1 .. 65535")) << port;
  EXPECT_THAT(sentence({"--mocap", ""}), HasSubstr("no protocol"));
  EXPECT_THAT(sentence({"--mocap", "vrpn://"}), HasSubstr("no host"));
  EXPECT_THAT(sentence({"--mocap", "opentrack", "--mocap-axes", "sideways"}), HasSubstr("xyz-ypr"));
  EXPECT_THAT(sentence({"--mocap", "freed", "--mocap-timecode", "26"}), HasSubstr("spare word"));
  EXPECT_THAT(sentence({"--mocap-subject", "Zoe"}), HasSubstr("--mocap"));
  EXPECT_THAT(sentence({"--mocap", "vmc", "--mocap-allow", "10.0.0.0/33"}), HasSubstr("--mocap-allow"));
  EXPECT_THAT(sentence({"--set", "live.0.delay_ms=5"}), HasSubstr("live.0.protocol"));
  EXPECT_THAT(sentence({"--mocap", "vmc", "--set", "live.0.delay_ms=500"}), HasSubstr("0 .. 200"));
  for (const char* scale : {"0", "-1", "0.0009", "1001", "nan", "inf", "two"}) {
    EXPECT_THAT(sentence({"--mocap", "vmc", "--mocap-scale", scale}),
                testing::AllOf(HasSubstr("--mocap-scale"), HasSubstr("0.001")))
        << scale;
    const std::string assignment = std::string("live.0.scale=") + scale;
    EXPECT_THAT(sentence({"--mocap", "vmc", "--set", assignment.c_str()}), HasSubstr("scale")) << scale;
  }
  EXPECT_THAT(sentence({"--mocap", "vmc", "--set", "live.0.scale=1001"}), HasSubstr("0.001 .. 1000"));
  EXPECT_EQ(sentence({"--mocap", "vmc", "--mocap-scale", "1000"}), "no error");
  EXPECT_EQ(sentence({"--mocap", "vmc", "--mocap-scale", "0.001"}), "no error");
  EXPECT_THAT(sentence({"--mocap-scale", "2"}), HasSubstr("--mocap"));
  const std::vector<const char*> many = {"--mocap", "vmc",     "--mocap", "vmc:1",   "--mocap",
                                         "vmc:2",   "--mocap", "vmc:3",   "--mocap", "vmc:4"};
  EXPECT_THAT(sentence(many), HasSubstr("the limit is 4"));
}

TEST(MocapOptions, AreExplained) {
  const auto lines = explain_live({{.protocol = "opentrack"}, {.protocol = "freed", .scale = 0.01}}, {});
  ASSERT_TRUE(lines) << lines.error().to_string();
  ASSERT_EQ(lines->size(), 2u);
  EXPECT_THAT((*lines)[0], testing::Not(HasSubstr("times")));
  EXPECT_THAT((*lines)[1], HasSubstr("places times 0.01"));
}

TEST(MocapOptions, WhoMaySendIsAListOfRanges) {
  const auto options = parse({"--mocap", "vmc", "--mocap-allow", "10.0.0.0/8", "--mocap-allow", "192.0.2.7"});
  ASSERT_TRUE(options) << options.error().to_string();
  const auto& allowed = options->config.live_allowed;
  ASSERT_EQ(allowed.size(), 2u);
  EXPECT_TRUE(is_in(allowed, *IpAddress::parse("10.9.8.7")));
  EXPECT_TRUE(is_in(allowed, *IpAddress::parse("192.0.2.7")));
  EXPECT_FALSE(is_in(allowed, *IpAddress::parse("192.0.2.8")));
}

using Change = SlowMotionWatch::Change;

TEST(SlowMotion, IsWhatLastsTwoSeconds) {
  SlowMotionWatch watch;
  int64_t now = 5;
  const auto after = [&](int64_t ms, double factor, bool is_paused = false) {
    now += ms * 1'000'000;
    return watch.update(factor, is_paused, now);
  };
  EXPECT_EQ(after(0, 0.94), Change::None);
  EXPECT_EQ(after(1'999, 0.5), Change::None);
  EXPECT_FALSE(watch.is_slow());
  EXPECT_EQ(after(1, 0.949), Change::Began) << "two seconds below";
  EXPECT_EQ(after(10'000, 0.5), Change::None) << "said once";
  EXPECT_EQ(after(0, 0.95), Change::None);
  EXPECT_EQ(after(1'500, 1.0), Change::None);
  EXPECT_EQ(after(100, 0.9), Change::None) << "not over yet";
  EXPECT_EQ(after(100, 1.0), Change::None);
  EXPECT_EQ(after(1'999, 1.0), Change::None);
  EXPECT_TRUE(watch.is_slow());
  EXPECT_EQ(after(1, 1.0), Change::Ended);
  // A short slow moment is none.
  EXPECT_EQ(after(0, 0.1), Change::None);
  EXPECT_EQ(after(1'900, 0.1), Change::None);
  EXPECT_EQ(after(50, 1.0), Change::None);
  EXPECT_EQ(after(100, 0.1), Change::None);
  EXPECT_EQ(after(1'999, 0.1), Change::None);
  EXPECT_EQ(after(1, 0.1), Change::Began);
  EXPECT_EQ(after(1, 0.0, true), Change::None) << "a pause is no slow motion";
  EXPECT_FALSE(watch.is_slow());
}

TEST(SlowMotion, WorkOfAStepIsWhatRunsForIt) {
  SceneDesc scene = built_in_scene();
  scene.step_rate_hz = 60.0;
  scene.stream.frame_rate_hz = 15.0;
  ServerCounters now;
  now.sim.step_median_ms = 8.0;
  now.sim.read_median_ms = 1.0;
  now.sim.quantise_median_ms = 2.0;
  now.encode.encode_median_ms = 4.0;
  now.frames.paint_median_ms = 100.0;
  now.frames.encode_median_ms = 20.0;
  EXPECT_EQ(work_per_step(scene, now).total_ms(), 8.0) << "nobody watches";
  now.strand_viewers = 1;
  EXPECT_EQ(work_per_step(scene, now).total_ms(), 15.0);
  scene.stream.strand_rate_hz = 15.0;
  EXPECT_EQ(work_per_step(scene, now).encode_ms, 1.0) << "every fourth state";
  now.frame_viewers = 1;
  EXPECT_EQ(work_per_step(scene, now).picture_ms, 30.0) << "a quarter as many pictures as steps";
  now.strand_viewers = 0;
  EXPECT_EQ(work_per_step(scene, now).encode_ms, 0.0);
  EXPECT_EQ(work_per_step(scene, now).picture_ms, 31.0) << "and one state for each";
}

TEST(SlowMotion, WaysOutSaveWhatTheySay) {
  SceneDesc scene = built_in_scene();
  scene.step_rate_hz = 60.0;
  scene.substeps = 4;
  const auto settings = [&](const StepWork& work) {
    std::vector<std::pair<std::string, double>> all;
    for (const WayOut& way : ways_out(scene, work)) all.emplace_back(way.setting, way.saved_ms);
    return all;
  };
  using Ways = std::vector<std::pair<std::string, double>>;
  EXPECT_EQ(settings({30.0, 1.0, 10.0, 0.0, 0}),
            (Ways{{"stream.strand_rate_hz=30", 5.0}, {"substeps=2", 15.0}}))
      << "those that are seen least, where none is enough";
  EXPECT_EQ(settings({20.0, 1.0, 10.0, 0.0, 0})[0],
            (std::pair<std::string, double>{"groom.procedural.vertex_count=8", 15.5}))
      << "what is enough alone stands first: 31 - 15.5 ms fit into 16.7";
  EXPECT_EQ(settings({20.0, 1.0, 0.5, 0.0, 0}),
            (Ways{{"substeps=2", 10.0}, {"groom.procedural.vertex_count=8", 10.75}}))
      << "encoding costs too little to save by it";
  scene.substeps = 1;
  EXPECT_EQ(settings({2.0, 1.0, 1.0, 60.0, 0})[0],
            (std::pair<std::string, double>{"stream.frame_rate_hz=7.5", 30.0}));
  scene.groom = FileGroomDesc{};
  EXPECT_EQ(settings({20.0, 0.0, 0.0, 0.0, 0}),
            (Ways{{"groom.file.vertex_count=8", 10.0}, {"step_rate_hz=30", 10.0}}));
  // A model that takes everything: another one alone brings real time back, and stands first.
  SceneDesc rods = built_in_scene();
  rods.solver.name = "direct_rod";
  const auto ways = ways_out(rods, {600.0, 1.0, 4.0, 0.0, 320'000});
  ASSERT_EQ(ways.size(), 2u);
  EXPECT_EQ(ways[0].setting, "solver.name=dftl");
  EXPECT_NEAR(ways[0].saved_ms, 595.5, 1e-9);
  EXPECT_TRUE(ways[0].is_live);
  EXPECT_TRUE(change_scene(rods, ways[0].setting).ok());
  EXPECT_EQ(ways[1].setting, "groom.procedural.vertex_count=8");
  // Each of them is a setting that a scene takes.
  for (const StepWork& work : {StepWork{20.0, 1.0, 10.0, 0.0, 0}, StepWork{2.0, 1.0, 1.0, 60.0, 0},
                               StepWork{20.0, 0.0, 0.0, 0.0, 0}})
    for (const WayOut& way : ways_out(built_in_scene(), work))
      EXPECT_TRUE(way.is_live ? change_scene(built_in_scene(), way.setting).ok()
                              : with_overrides(built_in_scene(), {way.setting}).ok())
          << way.setting;
  const std::string text = slow_motion_text(0.574, scene, {20.0, 0.0, 0.0, 0.0, 0});
  EXPECT_THAT(text, HasSubstr("0.57 of real time; its work takes 20.0 ms a step"));
  EXPECT_THAT(text, HasSubstr("groom.file.vertex_count=8 (10.0 ms less, --set at start); step_rate_hz=30"));
  EXPECT_LE(text.size(), kMaxTextChars);
  // Where the work is little, no setting helps.
  EXPECT_THAT(slow_motion_text(0.4, scene, {0.7, 0.0, 0.0, 0.0, 0}),
              HasSubstr("other programs hold the processors"));
  // Slow motion lasts for two seconds of real time; nobody is told of 1.00 as of something slow.
  const std::string ending = slow_motion_text(1.0, scene, {20.0, 0.0, 0.0, 0.0, 0});
  EXPECT_THAT(ending,
              HasSubstr("was slower than real time until a moment ago; its work takes 20.0 ms a step"));
  EXPECT_THAT(ending, Not(HasSubstr("1.00")));
}

TEST(CodecChoice, StepUnlessTangentTakesTooMuchOfTheTime) {
  // Two processors have 33.3 ms between two states of 60 a second, two thirds of which are 22.2.
  EXPECT_EQ(choose_codec(EncodeCost{22.2, 2, 60.0}).codec, "step");
  const CodecChoice dear = choose_codec(EncodeCost{22.3, 2, 60.0});
  EXPECT_EQ(dear.codec, "delta");
  EXPECT_THAT(dear.reason,
              HasSubstr("22.3 ms of processor time a state here, 22.2 ms are there (2 processors"));
  EXPECT_THAT(dear.reason, HasSubstr("--set stream.codec=step"));
  EXPECT_THAT(dear.reason, HasSubstr("stream.strand_rate_hz=30"));
  EXPECT_EQ(choose_codec(EncodeCost{44.4, 2, 30.0}).codec, "step") << "half as often, twice the time";
  EXPECT_EQ(choose_codec(EncodeCost{44.4, 4, 60.0}).codec, "step");
}

TEST(CodecChoice, WhatASceneNamesStays) {
  SceneAsset asset;
  asset.strand_count = 2;
  asset.vertex_count = 2;
  asset.rest_position_m.resize(4);
  const auto chosen = [&](const SceneDesc& scene) { return choose_codec(scene, asset, {}).value().codec; };
  EXPECT_EQ(chosen(built_in_scene()), "step") << "few vertices are not measured";
  EXPECT_EQ(chosen(parse_scene("", "empty", {}).value()), "step") << "scene files too";
  for (const char* codec : {"delta", "raw", "step", "tangent"}) {
    const auto named = built_in_scene_with({std::string("stream.codec=") + codec});
    EXPECT_TRUE(named->stream.has_codec);
    EXPECT_EQ(chosen(*named), codec);
    EXPECT_EQ(with_overrides(*named, {"wind.mean_mps.x=1"})->stream.codec, codec)
        << "through changes of others";
  }
}

// Large enough to be measured; whichever wins, it is one of the two, with its figures. Lanes share their
// states.
TEST(CodecChoice, MeasuresLargeScenesOfAGpu) {
  SceneDesc scene = built_in_scene();
  std::get<ProceduralGroomDesc>(scene.groom).strand_count = 4'100;
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  const SceneAsset asset = make_scene_asset(content->groom, {});
  const auto choice = choose_codec(scene, asset, {"gl", "auto", {}});
  ASSERT_TRUE(choice.ok()) << choice.error().to_string();
  EXPECT_THAT(choice->codec, testing::AnyOf("step", "delta"));
  EXPECT_THAT(choice->reason, HasSubstr("ms of processor time a state here"));
  const auto shared = choose_codec(scene, asset, {"lanes", "auto", {}});
  ASSERT_TRUE(shared.ok()) << shared.error().to_string();
  EXPECT_EQ(shared->codec, "step");
  EXPECT_THAT(shared->reason, HasSubstr("the simulation's own steps"));
}

TEST(ServerMetrics, SayThatItIsSlow) {
  ServerCounters counters;
  EXPECT_THAT(format_server_metrics(counters, "1"), HasSubstr("\nstrandcast_sim_slow_motion 0\n"));
  counters.is_slow = true;
  counters.slow_motions = 3;
  EXPECT_THAT(format_server_metrics(counters, "1"), HasSubstr("\nstrandcast_sim_slow_motion 1\n"));
  EXPECT_THAT(format_server_metrics(counters, "1"), HasSubstr("\nstrandcast_sim_slow_motions_total 3\n"));
}

TEST(ServerMetrics, FollowTheirFormat) {
  ServerCounters counters;
  counters.sim.tick = 12'345'678'901;
  for (const double value_ms : {0.1, 0.5, 0.6, 900.0, 5'000.0}) counters.sim.step_times.add_ms(value_ms);
  const std::string text = format_server_metrics(counters, "1.2.3");
  EXPECT_THAT(test::metric_faults(text), testing::IsEmpty());
  std::vector<std::string> faults;
  auto families = test::read_metrics(text, faults);
  EXPECT_THAT(text, testing::HasSubstr("\nstrandcast_sim_steps_total 12345678901\n")) << "not rounded";
  EXPECT_EQ(families["strandcast_build_info"].samples[0].first, "strandcast_build_info{version=\"1.2.3\"}");
  const auto& steps = families["strandcast_sim_step_ms"].samples;
  ASSERT_EQ(steps.size(), Histogram::kBoundsMs.size() + 3);
  EXPECT_EQ(steps[0].second, 2.0) << "0.5 belongs to the bucket that it ends";
  EXPECT_EQ(steps[1].second, 3.0);
  EXPECT_EQ(steps[Histogram::kBoundsMs.size()].second, 5.0);
}

TEST(ServerMetrics, SayWhatSimulates) {
  ServerCounters counters;
  EXPECT_THAT(format_server_metrics(counters, "1"), testing::Not(HasSubstr("sim_device_info")));
  counters.sim.sim_device = "gl";
  counters.sim.sim_device_name = "OpenGL, a \"quoted\" device \\ {x, 2}";
  const std::string text = format_server_metrics(counters, "1");
  EXPECT_THAT(test::metric_faults(text), testing::IsEmpty());
  EXPECT_THAT(text, HasSubstr("\nstrandcast_sim_device_info{device=\"gl\",name=\"OpenGL, a \\\"quoted\\\" "
                              "device \\\\ {x, 2}\"} 1\n"));
}

TEST(ServerMetrics, SayWhichCodecViewersGet) {
  ServerCounters counters;
  EXPECT_THAT(format_server_metrics(counters, "1"), testing::Not(HasSubstr("of_codec")));
  counters.strand_viewers_of = {{"delta", 2}, {"raw", 0}};
  const std::string text = format_server_metrics(counters, "1");
  EXPECT_THAT(test::metric_faults(text), testing::IsEmpty());
  EXPECT_THAT(text, HasSubstr("\nstrandcast_viewers_strands_of_codec{codec=\"delta\"} 2\n"
                              "strandcast_viewers_strands_of_codec{codec=\"raw\"} 0\n"));
}

// The reader above finds what it is there to find.
TEST(ServerMetrics, FaultsAreFound) {
  const std::string good = "# HELP a_total A.\n# TYPE a_total counter\na_total 1\n";
  EXPECT_THAT(test::metric_faults(good), testing::IsEmpty());
  for (const char* wrong :
       {"# TYPE a_total counter\na_total 1\n", "# HELP a_total A.\na_total 1\n", "a_total 1\n",
        "# HELP a_total A.\n# TYPE a_total counter\n", "# HELP a A.\n# TYPE a counter\na 1\n",
        "# HELP a_total A.\n# TYPE a_total counter\na_total nan\n",
        "# HELP a_total A.\n# TYPE a_total counter\na_total 1\na_total 2\n",
        "# HELP a_total A.\n# TYPE a_total counter\nb_total 1\n", "# HELP a A.\n# TYPE a gauge\na 1",
        "# HELP h H.\n# TYPE h histogram\nh_bucket{le=\"1\"} 2\nh_bucket{le=\"+Inf\"} 1\nh_sum 1\nh_count "
        "1\n",
        "# HELP h H.\n# TYPE h histogram\nh_bucket{le=\"1\"} 1\nh_sum 1\nh_count 1\n"})
    EXPECT_FALSE(test::metric_faults(wrong).empty()) << wrong;
  EXPECT_FALSE(test::metric_faults(good + good).empty());
}

TEST(ServerOptions, ReadsWhatTheCommandLineSays) {
  const auto options = parse({"--port", "0", "--set", "substeps=2", "--set", "wind.seed=7", "--groom",
                              "a.tfx", "--listen", "::1", "--seconds", "2.5"});
  ASSERT_TRUE(options.ok()) << options.error().to_string();
  EXPECT_EQ(options->config.net.port, 0);
  EXPECT_EQ(options->config.net.address, "::1");
  EXPECT_THAT(options->overrides,
              testing::ElementsAre("groom.file.path=a.tfx", "head.radius_m=0", "substeps=2", "wind.seed=7"));
  EXPECT_EQ(options->run_s, 2.5);
  EXPECT_EQ(options->config.net.limits.viewer_bytes_per_s, 0.0) << "no cap unless asked for";
  const auto parts = parse({"--groom", "a.tfx,b.tfx", "--groom", "c.hair"});
  ASSERT_TRUE(parts) << parts.error().to_string();
  EXPECT_THAT(parts->overrides, testing::ElementsAre("groom.file.path=a.tfx", "groom.file.more_paths.0=b.tfx",
                                                     "groom.file.more_paths.1=c.hair", "head.radius_m=0"));
  const auto check = parse({"--check", "a.tfx", "--out", "seen"});
  ASSERT_TRUE(check) << check.error().to_string();
  EXPECT_TRUE(check->is_checking);
  EXPECT_EQ(check->check_folder, "seen");
  EXPECT_THAT(check->overrides, testing::ElementsAre("groom.file.path=a.tfx", "head.radius_m=0"));
  EXPECT_FALSE(parse({"--out", "seen"})) << "of what?";
  EXPECT_EQ(parse({"--viewer-mbit", "8"})->config.net.limits.viewer_bytes_per_s, 1e6);
  EXPECT_TRUE(parse({"--explain"})->is_explaining);
  EXPECT_EQ(parse({"--explain", "x.textproto"})->scene_path, "x.textproto");
  EXPECT_FALSE(parse({"--help"})->help.empty());
  EXPECT_EQ(parse({"--version"})->help, fmt::format("strandcast-server {}\n", version()));
}

TEST(ServerOptions, ARelayHasNoSceneOfItsOwn) {
  const auto relay = parse({"--upstream", "wss://studio:83/s/anna", "--upstream-head", "ben", "--port", "0"});
  ASSERT_TRUE(relay) << relay.error().to_string();
  ASSERT_TRUE(relay->upstream.has_value());
  EXPECT_EQ(relay->upstream->address, (Address{"studio", 83, true, "anna"}));
  EXPECT_EQ(relay->upstream->head, "ben");
  EXPECT_FALSE(parse({})->upstream.has_value());
  const auto both = parse({"--upstream", "studio", "--scene", "x.textproto", "--lockstep"});
  ASSERT_FALSE(both);
  EXPECT_THAT(both.error().message, testing::HasSubstr("leave out --scene, --lockstep"));
  EXPECT_FALSE(parse({"--upstream", "studio:0"}));
  EXPECT_FALSE(parse({"--upstream-head", "ben"})) << "of which server?";
}

TEST(ServerOptions, NamesWhatIsWrong) {
  for (const std::vector<const char*>& arguments : {std::vector<const char*>{"--nonsense"},
                                                    {"--port", "70000"},
                                                    {"--port", "x"},
                                                    {"--log-level", "loud"},
                                                    {"--seconds", "-1"},
                                                    {"--explain", "a", "--scene", "b"}}) {
    const auto options = parse(arguments);
    ASSERT_FALSE(options.ok()) << arguments[0];
    EXPECT_FALSE(options.error().message.empty());
  }
}

}  // namespace
}  // namespace strandcast::server_app_test
