// StreamRecording: strands moved by the server's own solver under a head motion, stored as float positions in
// head space, so that every codec gets the same frames. Runs on the executor's thread.
#pragma once

#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "server/report/stream_codec.h"
#include "server/report/stream_motion.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Memory limit of a recording.
inline constexpr size_t kMaxRecordingBytes = size_t{1} << 30;

/// Number of first frames that are ignored because their differences are not typical yet; codec_bench does
/// the same.
inline constexpr size_t kStartFrames = 9;

struct StreamSize {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;

  size_t vertices() const { return static_cast<size_t>(strand_count) * vertex_count; }
};
/// Returns a size as text: "10000 x 16".
std::string to_string(const StreamSize& size);

/// Name of the double-precision solver, whose steps codecs cannot predict.
inline constexpr const char* kMovedByReference = "double";

/// Name that stands for the built-in scene in full quality with its style, in place of a solver's name.
inline constexpr const char* kFullHair = "full";

struct RecordingDesc {
  StreamMotion motion;
  StreamSize size;
  double seconds = 3.0;
  std::string solver;            // empty: the built-in scene's; kFullHair
  Executor* executor = nullptr;  // nullptr: the double-precision solver
  MotionPart part = MotionPart::Median;
};

struct StreamRecording {
  std::string motion_name;
  std::string solver;
  std::string moved_by;       // the executor: "gl", "lanes"; kMovedByReference. Others round otherwise
  HeadPace head;              // of the recorded part
  double hair_rms_mps = 0.0;  // of all vertices, in head space
  MotionLevel motion_level = MotionLevel::Idle;  // of the whole motion
  MotionPart part = MotionPart::Median;
  StreamShape shape;
  std::vector<StreamFrame> frames;
  std::vector<double> step_ms;  // (frames) wall time of solving and reading back
};

/// Returns the built-in scene with these strands and this solver.
SceneDesc recorded_scene(const RecordingDesc& desc);

/// Returns BadInput if the motion is too short, LimitExceeded if the recording would be too large.
Status check_recording(const RecordingDesc& desc);

/// Records one part of the motion after strands have settled into it, at 60 steps a second. Uses the built-in
/// scene with its head, wind and follicles, so that the recording is what a viewer gets.
Result<StreamRecording> record_strands(const RecordingDesc& desc);

}  // namespace strandcast
