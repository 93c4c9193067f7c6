// Runs of a whole server that are recorded, and simulated again from their recordings.
#include <future>
#include <thread>

#include "client/app/feed.h"
#include "common/record/recording_check.h"
#include "common/record/recording_reader.h"
#include "server/record/replay.h"
#include "server/scene/scene_content.h"
#include "server/source/scene_change.h"
#include "tests/support/server_fixture.h"
#include "tests/support/stepped_hair.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::recording_run_test {
namespace {

using testing::HasSubstr;

class RecordedRun : public test::ServerFixture {
 protected:
  ServerConfig config() const {
    ServerConfig config;
    config.scene = test::bald_scene(40, 8);
    config.sim_device = "lanes";
    config.record = RecordConfig{path_, IfPresent::Refuse};
    return config;
  }
  /// Steps until so many more states are published.
  void run_steps(uint64_t count) {
    const uint64_t until = server_->counters().sim.tick + count;
    EXPECT_TRUE(eventually([&] { return server_->counters().sim.tick >= until; }));
  }
  int change(const std::string& assignment) { return run_command(ctl_target(), SetParameter{assignment}); }
  int command(Command command) { return run_command(ctl_target(), ControlCommand{command}); }

  /// A server that is fed, steered and stopped.
  void record() {
    ASSERT_TRUE(start(config()));
    std::atomic<bool> is_fed{false};
    FeedOptions live;
    live.is_live = true;
    std::thread feeder([&] { run_feed(ctl_target(), live, is_fed); });
    run_steps(20);
    EXPECT_EQ(change("substeps=2"), kDoneExit);
    EXPECT_EQ(change("stream.bound_m=0.0002"), kDoneExit);
    EXPECT_EQ(change("wind.mean_mps.x=400000"), kRefusedExit);
    EXPECT_EQ(change("look.hair_color=red"), kDoneExit);
    EXPECT_EQ(change("look.exposure=bright"), kRefusedExit);
    EXPECT_EQ(change("hair.wind=2.5"), kDoneExit);
    EXPECT_EQ(change("hair.stiffness=0.5"), kDoneExit);
    EXPECT_EQ(change("hair.stiffness=nan"), kRefusedExit);
    run_steps(20);
    EXPECT_EQ(command(Command::Pause), kDoneExit);
    EXPECT_EQ(command(Command::StepOnce), kDoneExit);
    EXPECT_EQ(command(Command::Resume), kDoneExit);
    run_steps(5);
    EXPECT_EQ(command(Command::Reset), kDoneExit);
    EXPECT_EQ(change("solver.name=pbd"), kDoneExit);
    run_steps(20);
    is_fed = true;
    feeder.join();
    server_->stop();
    server_.reset();
  }
  std::vector<RecordedMessage> messages() const {
    std::vector<RecordedMessage> all;
    const auto reader = RecordingReader::open(path_, RecordedPart::Messages);
    EXPECT_TRUE(reader) << reader.error().to_string();
    if (!reader) return all;
    for (auto item = (*reader)->next(); item && *item; item = (*reader)->next())
      all.push_back(std::get<RecordedMessage>((*item)->what));
    return all;
  }
  ReplayResult replay(const std::filesystem::path& path) {
    ReplayConfig config;
    config.recording = path;
    config.on_note = [this](const std::string& sentence) { notes_.push_back(sentence); };
    const auto result = replay_recording(config);
    EXPECT_TRUE(result) << result.error().to_string();
    return result ? *result : ReplayResult{};
  }
  /// The same recording with its messages changed.
  template <class Change>
  std::filesystem::path altered(const std::filesystem::path& from, const char* name,
                                Change change_message) const {
    const std::filesystem::path path = folder_.path() / name;
    const auto reader = RecordingReader::open(from);
    auto file = RecordFile::make(path, IfPresent::Refuse);
    EXPECT_TRUE(reader && file);
    (*file)->keep();
    RecordingStart start = (*reader)->start();
    change_message(start);
    RecordingWriter writer(**file, start, *(*reader)->asset_frame());
    for (auto item = (*reader)->next(); item && *item; item = (*reader)->next()) {
      if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what)) {
        writer.add((*item)->time_ns, *frame->frame);
        continue;
      }
      RecordedMessage message = std::get<RecordedMessage>((*item)->what);
      std::visit([&](auto& one) { change_message(one); }, message);
      writer.add((*item)->time_ns, 0, message);
    }
    writer.finish();
    return path;
  }

  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.path() / "run.mcap";
  std::vector<std::string> notes_;
};

TEST_F(RecordedRun, IsSimulatedAgainBitForBit) {
  record();
  if (IsSkipped()) return;
  const auto check = check_recording(path_);
  ASSERT_TRUE(check) << check.error().to_string();
  EXPECT_TRUE(check->is_sound()) << testing::PrintToString(check->problems);
  EXPECT_GT(check->states, 60u);
  EXPECT_GT(check->decoded_frames, 30u);
  EXPECT_EQ(check->decoded_frames, check->frames);
  for (int i = 0; i < 3; ++i) {
    const ReplayResult result = replay(path_);
    EXPECT_TRUE(result.is_equal()) << to_sentence(result);
    EXPECT_EQ(result.compared, check->states);
  }
  EXPECT_TRUE(notes_.empty()) << testing::PrintToString(notes_);
}

/// In lockstep nothing depends on who watches, unless the recording asks for exact frames.
TEST_F(RecordedRun, HasExactFramesInLockstepWhereItAsksForThem) {
  for (const double keyframe_s : {0.0, 10.0}) {
    ServerConfig recorded = config();
    recorded.is_lockstep = true;
    recorded.record->path = folder_.path() / (keyframe_s > 0.0 ? "exact.mcap" : "usual.mcap");
    recorded.record->keyframe_s = keyframe_s;
    ASSERT_TRUE(start(recorded));
    for (int i = 0; i < 75; ++i)
      ASSERT_EQ(run_command(ctl_target(), ControlCommand{Command::StepOnce, 2}), kDoneExit);
    server_->stop();
    server_.reset();

    const auto reader = RecordingReader::open(recorded.record->path);
    ASSERT_TRUE(reader) << reader.error().to_string();
    int exact_frames = 0, keyframes = 0;
    for (auto item = (*reader)->next(); item && *item; item = (*reader)->next())
      if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what)) {
        exact_frames += is_exact(*frame->frame) ? 1 : 0;
        keyframes += frame->is_keyframe() ? 1 : 0;
      }
    EXPECT_EQ(exact_frames >= 20, keyframe_s > 0.0) << exact_frames;
    EXPECT_EQ(exact_frames == 0, keyframe_s == 0.0);
    EXPECT_LE(keyframes, 2) << keyframe_s;
    const ReplayResult result = replay(recorded.record->path);
    EXPECT_TRUE(result.is_equal()) << to_sentence(result);
  }
}

/// Tied tips and free ones beside each other, with volume and body: each kind runs on its own.
TEST_F(RecordedRun, TipsOfBothKindsAreSimulatedAgain) {
  constexpr int kStrands = 20, kVertices = 8;
  FileGroomDesc hair;
  for (const int is_tied : {0, 1}) {
    std::string text = fmt::format(
        "version 2.0\nscale 1.0\nbothEndsImmovable {}\nmaxNumVerticesInStrand 16\nnumStrands {}\nis sorted "
        "1\n",
        is_tied, kStrands);
    for (int strand = 0; strand < kStrands; ++strand) {
      text += fmt::format("strand {} numVerts {} texcoord 0 0\n", strand, kVertices);
      for (int i = 0; i < kVertices; ++i)
        text += fmt::format("{} {} {}\n", 0.005 * strand - 0.05, 0.12 - 0.01 * i, 0.01 * is_tied - 0.11);
    }
    const std::filesystem::path path = folder_.write(is_tied != 0 ? "tied.tfx" : "free.tfx", text);
    if (is_tied == 0) hair.path = path;
    if (is_tied != 0) hair.more_paths = {path};
  }
  hair.unit_m = 1.0f;
  hair.has_up_axis = hair.has_yaw = hair.has_origin = true;
  ServerConfig both = config();
  both.scene.groom = hair;
  for (const char* const assignment : {"quality=full", "body.preset=upper_body"}) {
    const auto scene = change_scene(both.scene, assignment);
    ASSERT_TRUE(scene) << scene.error().to_string();
    both.scene = *scene;
  }
  const auto content = load_scene_content(both.scene);
  ASSERT_TRUE(content) << content.error().to_string();
  uint32_t tied = 0;
  for (uint32_t strand = 0; strand < content->groom.strand_count(); ++strand)
    tied += content->groom.pinned[content->groom.offset[strand + 1] - 1];
  ASSERT_EQ(tied, static_cast<uint32_t>(kStrands));
  ASSERT_TRUE(start(both));
  run_steps(40);
  server_->stop();
  server_.reset();
  const ReplayResult result = replay(path_);
  EXPECT_TRUE(result.is_equal()) << to_sentence(result);
  EXPECT_GT(result.compared, 40u);
}

/// Strands go on from those of viewers where a keyframe tells them: frames are exact, and the run can be
/// simulated again for all that.
TEST_F(RecordedRun, GoesOnFromWhatKeyframesTell) {
  // Without the early keyframe the first one to share comes after two seconds and more.
  constexpr uint64_t kAloneSteps = 110;
  constexpr int64_t kAloneNs = 1'800'000'000;
  for (const std::string quality : {"fast", "full"}) {
    ServerConfig recorded = config();
    recorded.scene = test::bald_scene(40, 8);
    const auto scene = change_scene(recorded.scene, "quality=" + quality);
    ASSERT_TRUE(scene) << scene.error().to_string();
    recorded.scene = *scene;
    recorded.record->path = folder_.path() / (quality + ".mcap");
    ASSERT_TRUE(start(recorded));
    const auto join = [&] {
      ClientConfig predicting = client_config();
      predicting.hello.step_ns = 1.0;
      const auto viewer = open(predicting);
      ASSERT_NE(viewer, nullptr);
      EXPECT_TRUE(pump_until({viewer.get()}, [&] { return viewer->replay().stats().keyframes > 0; }));
    };
    run_steps(kAloneSteps);
    for (int i = 0; i < 3; ++i) {
      join();
      run_steps(15);
    }
    EXPECT_EQ(command(Command::Reset), kDoneExit);
    run_steps(15);
    join();
    run_steps(15);
    server_->stop();
    server_.reset();

    const auto reader = RecordingReader::open(recorded.record->path);
    ASSERT_TRUE(reader) << reader.error().to_string();
    int hand_overs = 0, exact_frames = 0, exact_alone = 0;
    for (auto item = (*reader)->next(); item && *item; item = (*reader)->next()) {
      if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what)) {
        exact_frames += is_exact(*frame->frame) ? 1 : 0;
        exact_alone += is_exact(*frame->frame) && frame->frame->header.sim_time_ns < kAloneNs ? 1 : 0;
      } else
        hand_overs += std::holds_alternative<RecordedHandOver>(std::get<RecordedMessage>((*item)->what));
    }
    EXPECT_GE(hand_overs, 3) << quality;
    EXPECT_GE(exact_frames, 20) << quality;
    EXPECT_GE(exact_alone, 1) << quality << ": before somebody joins";
    const ReplayResult result = replay(recorded.record->path);
    EXPECT_TRUE(result.is_equal()) << quality << ": " << to_sentence(result);

    const auto without =
        altered(recorded.record->path, (quality + "_without.mcap").c_str(), [](auto& message) {
          if constexpr (std::is_same_v<std::decay_t<decltype(message)>, RecordedHandOver>)
            message.frame_sequence += 100'000;
        });
    EXPECT_THAT(replay(without).early_end, HasSubstr("is not in the recording"));
  }
}

// A groom so small that decoding all of it takes nothing.
TEST_F(RecordedRun, HasAKeyframeWithinFiveSeconds) {
  ServerConfig recorded = config();
  recorded.is_lockstep = true;
  ASSERT_TRUE(start(recorded));
  constexpr double kRunS = 12.0;
  // In pieces, so that the keyframe that is requested comes soon in simulated time too.
  constexpr double kPieceS = 0.5;
  const auto count = static_cast<uint32_t>(kPieceS * recorded.scene.step_rate_hz);
  for (double done_s = 0.0; done_s < kRunS; done_s += kPieceS)
    EXPECT_EQ(run_command(ctl_target(), ControlCommand{Command::StepOnce, count}), kDoneExit);
  server_->stop();
  server_.reset();
  const auto reader = RecordingReader::open(path_);
  ASSERT_TRUE(reader) << reader.error().to_string();
  std::vector<int64_t> times_ns = (*reader)->info().keyframe_sim_time_ns;
  times_ns.push_back((*reader)->info().last_sim_time_ns);
  EXPECT_GE(times_ns.back(), static_cast<int64_t>(0.9 * kRunS * kNsPerS));
  for (size_t i = 1; i < times_ns.size(); ++i)
    EXPECT_LE(times_ns[i] - times_ns[i - 1], static_cast<int64_t>(5.0 * kNsPerS));
}

TEST_F(RecordedRun, SaysWhoChangedWhatAndWhatCameIn) {
  record();
  if (IsSkipped()) return;
  std::vector<std::string> changes;
  size_t motion = 0, wind = 0, steps_with_motion = 0, lattices = 0;
  for (const RecordedMessage& message : messages()) {
    motion += std::holds_alternative<RecordedMotion>(message);
    wind += std::holds_alternative<RecordedWind>(message);
    lattices += std::holds_alternative<RecordedStream>(message);
    if (const auto* step = std::get_if<RecordedStep>(&message)) steps_with_motion += step->has_motion;
    const auto* change = std::get_if<RecordedChange>(&message);
    if (change == nullptr) continue;
    EXPECT_THAT(change->who, HasSubstr("controller"));
    const auto* parameter = std::get_if<SetParameter>(&change->what);
    changes.push_back((parameter != nullptr ? parameter->assignment : "command") +
                      (change->answer.is_error ? ": refused" : ""));
  }
  EXPECT_EQ(changes, (std::vector<std::string>{"substeps=2", "stream.bound_m=0.0002",
                                               "wind.mean_mps.x=400000: refused", "look.hair_color=red",
                                               "look.exposure=bright: refused", "hair.wind=2.5",
                                               "hair.stiffness=0.5", "hair.stiffness=nan: refused", "command",
                                               "command", "command", "command", "solver.name=pbd"}));
  EXPECT_GT(motion, 10u);
  EXPECT_GT(wind, 10u);
  EXPECT_GT(steps_with_motion, 30u);
  EXPECT_EQ(lattices, 1u);
}

TEST_F(RecordedRun, TellsTheFirstStepThatIsNotAsItWas) {
  record();
  if (IsSkipped()) return;
  constexpr uint64_t kTick = 30;
  // A head that is a tenth of a millimetre elsewhere, in one step.
  const auto moved = altered(path_, "moved.mcap", [](auto& message) {
    if constexpr (std::is_same_v<std::decay_t<decltype(message)>, RecordedStep>)
      if (message.tick == kTick) message.world_from_head.position_m.x += 1e-4;
  });
  const ReplayResult result = replay(moved);
  EXPECT_FALSE(result.is_equal());
  ASSERT_TRUE(result.difference) << to_sentence(result);
  EXPECT_EQ(result.difference->tick, kTick);
  EXPECT_EQ(result.equal + 1, result.compared);

  const auto elsewhere = altered(path_, "elsewhere.mcap", [](auto& message) {
    if constexpr (std::is_same_v<std::decay_t<decltype(message)>, RecordingStart>) {
      message.sim_device = "gl";
      message.server_version = "0.0.9";
    }
  });
  ReplayConfig on_lanes;
  on_lanes.recording = elsewhere;
  on_lanes.device.sim_device = "lanes";
  on_lanes.on_note = [this](const std::string& sentence) { notes_.push_back(sentence); };
  const auto other = replay_recording(on_lanes);
  ASSERT_TRUE(other) << other.error().to_string();
  ASSERT_EQ(notes_.size(), 2u);
  EXPECT_THAT(notes_[0], HasSubstr("recorded by strandcast-server 0.0.9"));
  EXPECT_THAT(notes_[1], HasSubstr("recorded on gl"));

  const auto bald = altered(path_, "bald.mcap", [](auto& message) {
    if constexpr (std::is_same_v<std::decay_t<decltype(message)>, RecordingStart>) {
      auto scene = parse_scene(message.scene_text, "test", {"groom.procedural.strand_count=41"});
      ASSERT_TRUE(scene);
      message.scene_text = to_line(*scene);
    }
  });
  ReplayConfig of_others;
  of_others.recording = bald;
  const auto refused = replay_recording(of_others);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().to_string(), HasSubstr("is not what was recorded"));
}

}  // namespace
}  // namespace strandcast::recording_run_test
