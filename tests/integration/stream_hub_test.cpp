// A server whose states come from a recording in memory and go to a recorder in memory: a source and a reader
// that the product does not know, without OpenGL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <thread>

#include "common/strands/strand_codec.h"
#include "server/app/viewers.h"
#include "tests/support/frame_recorder.h"
#include "tests/support/raw_client.h"
#include "tests/support/replay_source.h"
#include "tests/support/sample_asset.h"
#include "tests/support/server_fixture.h"

namespace strandcast::stream_hub_test {
namespace {

using test::FrameRecorder;
using test::RawClient;
using test::ReplaySource;
using testing::HasSubstr;

constexpr uint32_t kStrands = 40;
constexpr uint32_t kVertices = 6;
constexpr size_t kStates = 30;

/// Every vertex moves on by a little from state to state.
std::vector<std::shared_ptr<const Snapshot>> recorded_states(float quantum_m) {
  std::vector<std::shared_ptr<const Snapshot>> states;
  for (size_t i = 0; i < kStates; ++i) {
    auto state = std::make_shared<Snapshot>();
    state->tick = i + 1;
    state->sim_time_ns = static_cast<int64_t>(i) * 16'666'667;
    state->strand_count = kStrands;
    state->vertex_count = kVertices;
    state->quantum_m = quantum_m;
    for (uint32_t k = 0; k < 3 * kStrands * kVertices; ++k)
      state->lattice.push_back(static_cast<int32_t>(k * 37 % 1'000 + i * (k % 5)));
    states.push_back(std::move(state));
  }
  return states;
}

class StreamOfARecording : public test::ServerFixture {
 protected:
  void SetUp() override {
    ServerConfig config;
    config.scene = test::bald_scene();
    config.scene.stream.codec = "delta";
    config.fallback_codec = fallback_codec_;
    config.gl_device = "none at all";  // whoever asks for OpenGL fails
    const Result<float> quantum_m = lattice_step_m("delta", config.scene.stream.bound_m);
    ASSERT_TRUE(quantum_m.ok());
    states_ = recorded_states(*quantum_m);
    // The one line that makes it the source.
    config.make_source = [this](const ServerConfig&, InputHub&) { return make_source(); };
    config.make_painter = [this](const PainterConfig&) -> MakePicturePainter {
      return [this]() -> Result<std::unique_ptr<PicturePainter>> {
        ++painters_;
        return make_error(ErrorCode::Unavailable, "no OpenGL in this test");
      };
    };
    ASSERT_TRUE(start(std::move(config)));
  }
  Result<std::unique_ptr<StateSource>> make_source() {
    auto source = std::make_unique<ReplaySource>(
        std::make_shared<const SceneAsset>(sample_asset(kStrands, kVertices)), states_);
    source_ = source.get();
    return std::unique_ptr<StateSource>(std::move(source));
  }
  uint64_t encodes() const { return server_->counters().encode.encodes; }

  /// Frames of each stream that were encoded, by stream_id.
  std::map<uint16_t, uint64_t> encodes_by_stream() const {
    std::map<uint16_t, uint64_t> encodes;
    for (const auto& [stream_id, of_stream] : server_->counters().strand_streams)
      encodes[stream_id] = of_stream.encodes;
    return encodes;
  }

  std::string fallback_codec_;  // empty = none
  std::vector<std::shared_ptr<const Snapshot>> states_;
  ReplaySource* source_ = nullptr;
  std::atomic<int> painters_{0};
};

TEST_F(StreamOfARecording, ARecorderGetsEveryStateAndPosesAsNoViewer) {
  EXPECT_FALSE(source_->is_watched());
  FrameRecorder recorder;
  const ReaderId reader = server_->hub().add(recorder);
  Demand strands;
  strands.strand_stream = 0;
  ASSERT_TRUE(server_->hub().set_demand(reader, strands).ok());
  EXPECT_TRUE(source_->is_watched());
  for (size_t count = 1; count <= kStates; ++count) {
    ASSERT_TRUE(eventually([&] { return recorder.frames().size() >= count; })) << count;
    if (count < kStates) source_->play_next();
  }
  auto decoder = make_strand_decoder("delta", {kStrands, kVertices});
  ASSERT_TRUE(decoder.ok());
  const auto frames = recorder.frames();
  ASSERT_EQ(frames.size(), kStates) << "a keyframe, then one frame for each state";
  EXPECT_EQ(frames[0]->header.opcode, Opcode::StrandKeyframe);
  for (size_t i = 0; i < kStates; ++i) {
    const auto decoded = (*decoder)->decode(frames[i]->message);
    ASSERT_TRUE(decoded.ok()) << decoded.error().to_string();
    EXPECT_EQ(state_hash(**decoded), state_hash(*states_[i])) << i;
  }
  const ServerCounters counters = server_->counters();
  EXPECT_EQ(counters.viewers, 0u);
  EXPECT_EQ(counters.net.open_sessions, 0u);
  EXPECT_EQ(counters.strand_viewers, 1u) << "one reader of strands";

  server_->hub().remove(reader);
  EXPECT_FALSE(source_->is_watched());
  const uint64_t before = encodes();
  for (int i = 0; i < 5; ++i) source_->play_next();
  give_time_to_misbehave();
  EXPECT_EQ(encodes(), before) << "what nobody wants is not encoded";
  EXPECT_EQ(recorder.frames().size(), kStates);
  EXPECT_EQ(painters_, 0);
}

/// Two codecs that take the same states.
class StreamByTwoCodecs : public StreamOfARecording {
 protected:
  StreamByTwoCodecs() { fallback_codec_ = "raw"; }
  std::unique_ptr<ViewerSession> viewer_of(const std::string& wish) {
    ClientConfig config = client_config();
    config.hello.codec_wish = wish;
    return open(config);
  }
  static constexpr uint16_t kSecond = stream_id_of({1, 0});
};

TEST_F(StreamByTwoCodecs, ViewersOfBothSeeTheSameStates) {
  const auto scenes = viewer_of(""), other = viewer_of("raw"), lost = viewer_of("morse");
  ASSERT_TRUE(scenes != nullptr && other != nullptr && lost != nullptr);
  EXPECT_EQ(scenes->welcome().codec, "delta");
  EXPECT_EQ(scenes->welcome().codec_reason, "delta: the scene's codec");
  EXPECT_EQ(other->welcome().codec, "raw");
  EXPECT_EQ(other->welcome().codec_reason, "raw: asked for");
  EXPECT_EQ(lost->welcome().codec, "delta");
  EXPECT_THAT(lost->welcome().codec_reason, HasSubstr("morse was asked for and is not served"));
  std::map<const ViewerSession*, uint64_t> seen;
  for (ViewerSession* viewer : {scenes.get(), other.get(), lost.get()})
    viewer->set_snapshot_listener([&seen, viewer](const auto& state) { seen[viewer] = state_hash(*state); });
  for (size_t i = 0; i < kStates; ++i) {
    const uint64_t hash = state_hash(*states_[i]);
    ASSERT_TRUE(pump_until({scenes.get(), other.get(), lost.get()}, [&] {
      return seen[scenes.get()] == hash && seen[other.get()] == hash && seen[lost.get()] == hash;
    })) << i;
    if (i + 1 < kStates) source_->play_next();
  }
  const ServerCounters counters = server_->counters();
  EXPECT_EQ(counters.strand_viewers, 3u);
  EXPECT_EQ(counters.strand_viewers_of, (std::map<std::string, uint32_t>{{"delta", 2}, {"raw", 1}}));
  EXPECT_EQ(counters.strand_classes_in_use, 2u);
  for (const ViewerSession* viewer : {scenes.get(), other.get()})
    EXPECT_EQ(viewer->replay().stats().rejected_frames, 0u);
}

TEST_F(StreamByTwoCodecs, WhatNobodyGetsIsNotEncoded) {
  auto other = viewer_of("raw");
  ASSERT_NE(other, nullptr);
  ASSERT_TRUE(pump_until({other.get()}, [&] { return other->has_picture(); }));
  EXPECT_FALSE(encodes_by_stream().contains(0)) << "nobody gets delta";
  const auto scenes = viewer_of("delta");
  ASSERT_NE(scenes, nullptr);
  ASSERT_TRUE(pump_until({scenes.get()}, [&] { return scenes->has_picture(); }));
  other.reset();
  ASSERT_TRUE(eventually([&] { return server_->hub().strand_readers(kSecond) == 0; }));
  const uint64_t before = encodes_by_stream()[kSecond];
  for (size_t count = scenes->decoded_frames() + 1, i = 0; i < 5; ++i, ++count) {
    source_->play_next();
    ASSERT_TRUE(pump_until({scenes.get()}, [&] { return scenes->decoded_frames() >= count; }));
  }
  EXPECT_EQ(encodes_by_stream()[kSecond], before);
}

TEST_F(StreamByTwoCodecs, ARecorderTakesEither) {
  EXPECT_EQ(server_->hub().strand_codecs(), (std::vector<std::string>{"delta", "raw"}));
  FrameRecorder recorders[2];
  for (const size_t codec : {0, 1}) {
    Demand strands;
    strands.strand_stream = stream_id_of({codec, 0});
    const ReaderId reader = server_->hub().add(recorders[codec]);
    ASSERT_TRUE(server_->hub().set_demand(reader, strands).ok());
    ASSERT_TRUE(eventually([&] { return !recorders[codec].frames().empty(); }));
    const EncodedFramePtr first = recorders[codec].frames()[0];
    EXPECT_EQ(first->header.stream_id, *strands.strand_stream);
    auto decoder = make_strand_decoder(server_->hub().strand_codecs()[codec], {kStrands, kVertices});
    ASSERT_TRUE(decoder.ok());
    const auto decoded = (*decoder)->decode(first->message);
    ASSERT_TRUE(decoded.ok()) << decoded.error().to_string();
    EXPECT_EQ(state_hash(**decoded), state_hash(*states_[0]));
    server_->hub().remove(reader);
  }
  const size_t class_count = server_->hub().strand_classes().size();
  const ReaderId reader = server_->hub().add(recorders[0]);
  for (const StrandStream nowhere : {StrandStream{0, class_count}, {1, class_count}, {2, 0}}) {
    Demand wrong;
    wrong.strand_stream = stream_id_of(nowhere);
    EXPECT_EQ(server_->hub().set_demand(reader, wrong).error().code, ErrorCode::BadInput);
  }
}

TEST_F(StreamByTwoCodecs, PicturesAreDrawnFromTheOneThatEverybodyDecodes) {
  FrameRecorder recorder;
  Demand pictures;
  pictures.picture = make_scene_view(test::bald_scene(), {64, 48}, 0);
  const ReaderId reader = server_->hub().add(recorder);
  ASSERT_TRUE(server_->hub().set_demand(reader, pictures).ok());
  const auto encodes = encodes_by_stream();
  EXPECT_TRUE(encodes.contains(kSecond));
  EXPECT_FALSE(encodes.contains(0));
  server_->hub().remove(reader);
}

TEST_F(StreamByTwoCodecs, AChangeOfTheStreamReachesViewersOfBoth) {
  const auto scenes = viewer_of("delta"), other = viewer_of("raw");
  ASSERT_TRUE(scenes != nullptr && other != nullptr);
  StreamDesc stream = server_->hub().stream();
  stream.strand_rate_hz = 20.0;  // every third of 60 states a second
  server_->hub().change_stream(stream);
  EXPECT_TRUE(pump_until({scenes.get(), other.get()}, [&] {
    return scenes->quality().rate_divisor == 3 && other->quality().rate_divisor == 3;
  }));
  EXPECT_EQ(scenes->quality().stream_id, 0);
  EXPECT_EQ(other->quality().stream_id, kSecond);
}

TEST_F(StreamOfARecording, AViewerOnTheNetworkSeesTheRecording) {
  const auto viewer = open(client_config());
  ASSERT_NE(viewer, nullptr);
  uint64_t last_hash = 0;
  viewer->set_snapshot_listener([&](const auto& state) { last_hash = state_hash(*state); });
  for (size_t i = 0; i < kStates; ++i) {
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return last_hash == state_hash(*states_[i]); })) << i;
    if (i + 1 < kStates) source_->play_next();
  }
  EXPECT_EQ(viewer->replay().stats().rejected_frames, 0u);
  EXPECT_EQ(server_->counters().viewers, 1u);
  EXPECT_EQ(painters_, 0) << "nobody wanted pictures";
}

TEST_F(StreamOfARecording, StatesAndInputsComeToWhoWantsThem) {
  FrameRecorder recorder, indifferent;
  const ReaderId reader = server_->hub().add(recorder);
  (void)server_->hub().add(indifferent);
  Demand all;
  all.has_states = all.has_inputs = true;
  ASSERT_TRUE(server_->hub().set_demand(reader, all).ok());
  EXPECT_TRUE(source_->is_watched());
  source_->play_next();
  source_->play_next();
  EXPECT_EQ(recorder.state_hashes(),
            (std::vector<uint64_t>{state_hash(*states_[1]), state_hash(*states_[2])}));
  EXPECT_EQ(encodes(), 0u) << "no frames were asked for";

  RawClient source(server_->port());
  ASSERT_TRUE(source.handshake());
  Hello hello;
  hello.role = Role::Source;
  source.send(hello);
  ASSERT_TRUE(source.read_control<Welcome>().has_value());
  source.send(MotionSamples{{MotionSamples::Sample{1'000, {}}, MotionSamples::Sample{2'000, {}}}});
  EXPECT_TRUE(eventually([&] { return recorder.motion_samples() == 2; }));
  EXPECT_TRUE(indifferent.state_hashes().empty());
  EXPECT_EQ(indifferent.motion_samples(), 0u);
}

TEST_F(StreamOfARecording, WhatASourceCannotDoIsSaidInOneSentence) {
  RawClient controller(server_->port());
  ASSERT_TRUE(controller.handshake());
  Hello hello;
  hello.role = Role::Controller;
  controller.send(hello);
  ASSERT_TRUE(controller.read_control<Welcome>().has_value());
  controller.send(ControlCommand{Command::Pause});
  const auto notice = controller.read_control<Notice>();
  ASSERT_TRUE(notice.has_value());
  EXPECT_THAT(notice->text, HasSubstr("recording"));
}

TEST_F(StreamOfARecording, TheNetworkHearsOfAChangeOfTheStreamWhileNobodyIsConnected) {
  StreamDesc stream = server_->hub().stream();
  stream.strand_rate_hz = 20.0;  // every third of 60 states a second
  server_->hub().change_stream(stream);
  ASSERT_TRUE(eventually([&] { return server_->hub().stream().strand_rate_hz == 20.0; }));
  const auto viewer = open(client_config());
  ASSERT_NE(viewer, nullptr);
  EXPECT_TRUE(pump_until({viewer.get()}, [&] { return viewer->quality().rate_divisor == 3; }));
}

/// Takes its time to hear of a change.
class SlowReader : public StreamReader {
 public:
  void on_stream_change(const std::vector<StrandClass>&, std::shared_ptr<void>) override {
    is_being_told = true;
    (void)eventually([this] { return may_go.load(); });
    is_being_told = false;
  }
  std::atomic<bool> is_being_told{false}, may_go{false};
};

TEST_F(StreamOfARecording, AReaderThatWasRemovedIsNotBeingToldOfAChange) {
  SlowReader reader;
  const ReaderId id = server_->hub().add(reader);
  std::thread changing([&] { server_->hub().change_stream(server_->hub().stream()); });
  ASSERT_TRUE(eventually([&] { return reader.is_being_told.load(); }));
  std::atomic<bool> is_removed{false};
  std::thread removing([&] {
    server_->hub().remove(id);
    EXPECT_FALSE(reader.is_being_told);
    is_removed = true;
  });
  give_time_to_misbehave();
  EXPECT_FALSE(is_removed) << "it may end its life then";
  reader.may_go = true;
  changing.join();
  removing.join();
}

/// Asks for what it needs from within what it is given, as a recorder that begins a file does.
class AskingRecorder : public FrameRecorder {
 public:
  explicit AskingRecorder(StreamHub& hub) : hub_(hub) {}
  void on_strands(const EncodedFramePtr& frame) override {
    hub_.request_keyframe(frame->header.stream_id);
    hub_.request_whole(0);
    FrameRecorder::on_strands(frame);  // last: the test goes on when it is there
  }

 private:
  StreamHub& hub_;
};

TEST_F(StreamOfARecording, AReaderMayAskFromWithinWhatItIsGiven) {
  AskingRecorder recorder(server_->hub());
  const ReaderId reader = server_->hub().add(recorder);
  Demand strands;
  strands.strand_stream = 0;
  ASSERT_TRUE(server_->hub().set_demand(reader, strands).ok());
  const auto keyframe_count = [&] {
    const auto frames = recorder.frames();
    return std::count_if(frames.begin(), frames.end(), [](const EncodedFramePtr& frame) {
      return frame->header.opcode == Opcode::StrandKeyframe;
    });
  };
  for (int count = 1; count <= 4; ++count) {
    EXPECT_TRUE(eventually([&] { return keyframe_count() >= count; })) << "each is asked for by a frame";
    source_->play_next();
  }
  server_->hub().remove(reader);
}

TEST_F(StreamOfARecording, ADemandThatCannotBeMetChangesNothing) {
  FrameRecorder recorder;
  const ReaderId reader = server_->hub().add(recorder);
  Demand demand;
  demand.strand_stream = 0;
  ASSERT_TRUE(server_->hub().set_demand(reader, demand).ok());
  for (const auto& spoil : std::vector<std::function<void(Demand&)>>{
           [](Demand& wrong) { wrong.strand_stream = 999; },
           [](Demand& wrong) {
             wrong.picture = PictureView{{}, {1, 1}, 80, 1, PictureCodec::Jpeg};
           }}) {
    Demand wrong = demand;
    spoil(wrong);
    EXPECT_FALSE(server_->hub().set_demand(reader, wrong).ok());
    EXPECT_EQ(server_->hub().strand_readers(0), 1u);
  }
  EXPECT_FALSE(server_->hub().set_demand(reader + 100, demand).ok()) << "nobody";
  server_->hub().remove(reader);
  EXPECT_EQ(server_->hub().strand_readers(0), 0u);
}

}  // namespace
}  // namespace strandcast::stream_hub_test
