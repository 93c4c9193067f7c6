// libFuzzer entry: a viewer's replay of strands from a server that names any times, poses and numbers it
// likes. Frames are well made ("raw"), so that what they say is believed. Steps of one byte for the kind,
// then numbers.
#include <array>
#include <cmath>

#include "common/base/check.h"
#include "common/replay/strand_replay.h"
#include "common/strands/strand_limits.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::strand_replay_fuzz {
namespace {

enum class Step : uint8_t { Frame, Pong, Picture, Playout, Damaged };
constexpr int kStepKinds = 5;
constexpr int kMostSteps = 200;
constexpr uint32_t kStrands = 6;  // of the scene; frames have 1 or more of them
constexpr uint32_t kVertices = 2;

class ReplayGame {
 public:
  ReplayGame() {
    replay_ = std::move(StrandReplay::make("raw", {kStrands, kVertices}, [this] { ++requests_; })).value();
    encoder_ = std::move(make_strand_encoder("raw")).value();
  }

  void step(Step kind, FuzzInput& input) {
    now_ns_ += input.take<uint16_t>() * int64_t{50'000};
    switch (kind) {
      case Step::Frame:
        receive(input);
        break;
      case Step::Pong: {
        const int64_t sent_ns = now_ns_ - input.take<uint32_t>();
        const int64_t received_ns = take_time(input);
        clock_.add(sent_ns, received_ns, take_time(input), now_ns_);
        break;
      }
      case Step::Picture:
        check_strands();
        break;
      case Step::Playout: {
        const auto what = input.take<uint8_t>();
        replay_->set_playout((what & 1) != 0 ? Playout::Smooth : Playout::LowLatency);
        if ((what & 2) != 0) set_rest_shape(input);
        break;
      }
      case Step::Damaged:
        (void)replay_->receive(input.take_bytes(input.take<uint8_t>()), now_ns_, clock_);
        break;
    }
  }

  void check_strands() {
    CHECK(std::isfinite(replay_->state_age_ms(now_ns_, clock_)) && replay_->playout_delay_ms() >= 0.0);
    const auto strands = replay_->strands_at(now_ns_);
    CHECK(strands.has_value() == (replay_->newest() != nullptr));
    if (!strands) return;
    CHECK(is_finite(strands->world_from_head));
    CHECK(strands->position_m.size() % kVertices == 0 && !strands->position_m.empty());
    CHECK(strands->position_m.size() <= size_t{kStrands} * kVertices);
    for (const glm::vec3& point : strands->position_m)
      CHECK(std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z));
  }

 private:
  /// A time near the client's, or any at all.
  int64_t take_time(FuzzInput& input) const {
    const auto kind = input.take<uint8_t>();
    return (kind & 1) != 0 ? input.take<int64_t>() : now_ns_ + input.take<int32_t>();
  }

  /// Any that an asset may hold.
  void set_rest_shape(FuzzInput& input) {
    std::vector<glm::vec3> rest_in_head_m(size_t{kStrands} * kVertices);
    for (glm::vec3& point : rest_in_head_m)
      for (int axis = 0; axis < 3; ++axis)
        point[axis] = static_cast<float>(input.take<int16_t>()) * (kMaxGroomExtentM / 0x8000);
    replay_->set_rest_shape(rest_in_head_m);
  }

  void receive(FuzzInput& input) {
    const auto kind = input.take<uint8_t>();
    Snapshot snapshot;
    snapshot.tick = ++tick_;
    snapshot.sim_time_ns = take_time(input);
    snapshot.motion_time_ns = (kind & 1) != 0 ? take_time(input) : 0;
    if ((kind & 2) != 0) {
      for (int axis = 0; axis < 3; ++axis) snapshot.world_from_head.position_m[axis] = input.take<double>();
      for (int k = 0; k < 4; ++k) snapshot.world_from_head.rotation[k] = input.take<double>();
    }
    snapshot.strand_count = (kind & 32) != 0 ? 1 + input.take<uint8_t>() % kStrands : 1;
    snapshot.vertex_count = kVertices;
    snapshot.quantum_m = (kind & 4) != 0 ? input.take<float>() : 1e-4f;
    for (size_t i = 0; i < 3 * snapshot.plane_size(); ++i) snapshot.lattice.push_back(input.take<int16_t>());
    const EncodedFramePtr frame = encoder_->encode(snapshot);
    const uint16_t stream_id = (kind & 8) != 0 ? input.take<uint8_t>() : 0;
    const int64_t send_time_ns = (kind & 16) != 0 ? take_time(input) : now_ns_;
    (void)replay_->receive(with_send_time(*frame, stream_id, send_time_ns)->message, now_ns_, clock_);
  }

  std::unique_ptr<StrandReplay> replay_;
  std::unique_ptr<StrandEncoder> encoder_;
  ClockOffset clock_;
  int64_t now_ns_ = 1'000'000'000;
  uint64_t tick_ = 0;
  int requests_ = 0;
};

}  // namespace

extern "C" int FUZZ_ENTRY(strand_replay)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  ReplayGame game;
  for (int i = 0; i < kMostSteps && !input.is_empty(); ++i) {
    const auto kind = static_cast<Step>(input.take<uint8_t>() % kStepKinds);
    game.step(kind, input);
  }
  game.check_strands();
  return 0;
}

}  // namespace strandcast::strand_replay_fuzz
