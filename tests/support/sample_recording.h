// A small recording in memory, with a message of every kind and frames that nothing decodes.
#pragma once

#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/hash.h"
#include "common/record/chunk_list.h"
#include "common/record/recording_writer.h"
#include "common/strands/strand_codec.h"
#include "tests/support/sample_asset.h"
#include "tests/support/sample_look.h"

namespace strandcast::test {

/// Keeps what it is given; refuses while it is full.
class MemorySink : public mcap::ByteSink {
 public:
  bool take(mcap::Bytes bytes, bool is_vital) override {
    if (is_full && !(is_vital && takes_vital)) return false;
    all.insert(all.end(), bytes.begin(), bytes.end());
    return true;
  }

  mcap::Bytes all;
  bool is_full = false;
  bool takes_vital = true;
};

inline EncodedFramePtr sample_asset_frame() {
  FrameHeader header;
  header.opcode = Opcode::Asset;
  header.sequence = 1;
  return make_encoded_frame(header, encode_scene_asset(sample_asset(4, 3)));
}

inline RecordingStart sample_start() {
  RecordingStart start;
  start.server_version = "0.1.0";
  start.sim_device = "lanes";
  start.sim_device_name = "lanes (AVX2, 2 threads)";
  start.codec = "delta";
  start.scene_text = "name: \"walk\" step_rate_hz: 120";
  start.server_time_ns = 5'000'000'000;
  start.unix_time_ns = 1'700'000'000'000'000'000;
  start.slate = "12A";
  start.take = 3;
  start.asset_hash =
      hash_bytes(std::span<const std::byte>(sample_asset_frame()->message).subspan(kFrameHeaderBytes));
  return start;
}

inline EncodedFrame sample_frame(uint32_t sequence, bool is_keyframe, int64_t sim_time_ns) {
  FrameHeader header;
  header.opcode = is_keyframe ? Opcode::StrandKeyframe : Opcode::StrandDelta;
  header.sequence = sequence;
  header.base_sequence = is_keyframe ? 0 : sequence - 1;
  header.sim_time_ns = sim_time_ns;
  const std::vector<std::byte> payload(20 + sequence, static_cast<std::byte>(sequence));
  return *make_encoded_frame(header, payload);
}

/// One of every kind but RecordingStart, with every field away from its default.
inline std::vector<RecordedMessage> sample_recorded_messages() {
  MotionSamples motion;
  motion.samples = {{7, {{0.1, -2.0, 1e5}, {0.5, 0.5, -0.5, 0.5}}, {{0.25f, -0.5f, 0.125f}}}};
  motion.held_back = 0.5;
  motion.joint_names = {"neck"};
  motion.timecode = Timecode{{30, 1}, false, 7, 0.5};
  RecordedStep step;
  step.tick = 11;
  step.time_ns = -5;
  step.input_rate = 1.25;
  step.world_from_head = {{0.1, 0.2, 0.3}, {0.5, -0.5, 0.5, 0.5}};
  step.joints = {{"neck", "chest"}, {{0.1, 0.2, 0.3}, {1.0 / 3.0, -4.0, 5.0}}};
  step.wind_mps = {1.5f, -2.5f, 3.5f};
  step.has_motion = step.has_wind_stream = step.has_teleported = true;
  step.is_motion_stale = false;
  step.motion_speed = 0.75;
  step.motion_time_ns = 123;
  step.rejected_samples = 3;
  step.timecode = Timecode{{60000, 1001}, true, 9, 0.25};
  ServerStatus status;
  status.tick = 9;
  status.is_paused = true;
  return {
      RecordedMotion{3, 77, motion},
      RecordedWind{4, 78, {{{-7, {1.5f, -3.0f, 0.25f}}}}},
      step,
      RecordedChange{12, SetParameter{"wind.mean_mps.x=3"}, "session 5 (controller 'manager')", {true, "no"}},
      RecordedChange{13, ControlCommand{Command::Reset}, "", {false, "done"}},
      RecordedStream{14, "delta", 2e-4},
      RecordedState{15, 250'000'000, 0xfedcba9876543210u, Timecode{{25, 1}, false, 1}},
      RecordedCamera{16, sample_camera()},
      RecordedLoss{1, 2, 3},
      LookChange{sample_look(), sample_camera()},
      status,
      RecordedHandOver{17, 12, 18}};
}

/// Two seconds with ten states and frames each, a keyframe at the beginning of both; flushed after each.
inline RecordingWriter& write_sample(RecordingWriter& writer) {
  constexpr int64_t kStepNs = 100'000'000;
  for (const RecordedMessage& message : sample_recorded_messages())
    writer.add(sample_start().server_time_ns, 0, message);
  for (uint32_t i = 0; i < 20; ++i) {
    const int64_t sim_time_ns = i * kStepNs;
    const int64_t time_ns = sample_start().server_time_ns + sim_time_ns;
    writer.add(time_ns, sim_time_ns, RecordedState{i, sim_time_ns, 1000 + i});
    writer.add(time_ns + 1, sample_frame(i + 1, i % 10 == 0, sim_time_ns));
    if (i % 10 == 9) writer.flush();
  }
  return writer;
}

/// States of the sample asset that move, a tenth of a second apart, and their frames by "delta"; a keyframe
/// first and at every tenth. `first_shift` moves all vertices of all states along x, in lattice steps.
inline mcap::Bytes moving_recording(uint32_t state_count, int32_t first_shift = 0) {
  constexpr int64_t kStepNs = 100'000'000;
  MemorySink sink;
  RecordingWriter writer(sink, sample_start(), *sample_asset_frame());
  auto encoder = make_strand_encoder(sample_start().codec);
  CHECK(encoder.ok());
  (*encoder)->set_rest_shape(sample_asset(4, 3).rest_position_m);
  const Result<float> quantum_m = lattice_step_m(sample_start().codec, 1e-4f);
  CHECK(quantum_m.ok());
  for (uint32_t i = 0; i < state_count; ++i) {
    Snapshot state;
    state.tick = i;
    state.sim_time_ns = i * kStepNs;
    state.strand_count = 4;
    state.vertex_count = 3;
    state.quantum_m = *quantum_m;
    for (int32_t k = 0; k < 36; ++k)
      state.lattice.push_back(17 * k + static_cast<int32_t>(i) * (k % 5) + (k < 12 ? first_shift : 0));
    const int64_t time_ns = sample_start().server_time_ns + state.sim_time_ns;
    RecordedStep step;
    step.tick = i;
    if (i > 0) writer.add(time_ns, state.sim_time_ns, step);
    writer.add(time_ns, state.sim_time_ns, RecordedState{i, state.sim_time_ns, state_hash(state)});
    const bool is_keyframe = i % 10 == 0;
    const EncodedFramePtr frame =
        is_keyframe ? (*encoder)->encode_for_join(state).keyframe : (*encoder)->encode(state);
    writer.add(time_ns + 1, *frame);
    if (is_keyframe) writer.flush();
  }
  writer.finish();
  return sink.all;
}

/// The same without the descriptions of its messages, which are long and which our reader does not read.
inline mcap::Bytes without_schemas(const mcap::Bytes& recording) {
  const auto source = memory_byte_source(recording);
  const auto list = walk_chunks(*source);
  CHECK(list.ok());
  MemorySink sink;
  mcap::McapWriter writer(sink, {kRecordingProfile, "test"}, {}, recording_channels());
  for (const ChunkPlace& place : list->chunks) {
    auto chunk = load_chunk(*source, place);
    CHECK(chunk.ok());
    auto body = chunk_body_of(std::move(chunk->records));
    CHECK(body.ok());
    const mcap::Bytes& stored = chunk->compression.empty() ? body->records : chunk->stored;
    writer.write(*body, stored, chunk->compression, true);
  }
  writer.finish();
  return sink.all;
}

inline mcap::Bytes sample_recording() {
  MemorySink sink;
  RecordingWriter writer(sink, sample_start(), *sample_asset_frame());
  write_sample(writer).finish();
  return sink.all;
}

}  // namespace strandcast::test
