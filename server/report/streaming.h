// strandcast-report streaming: error against bytes against milliseconds of every strand codec, beside general
// codecs on the same frames. This header is what is measured; streaming_page.h turns it into files.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "server/report/stream_codec.h"
#include "server/report/stream_latency.h"
#include "server/report/stream_recording.h"

namespace strandcast {

struct StreamingOptions {
  std::filesystem::path out;                   // folder of the CSV, plots and page
  std::vector<std::filesystem::path> motions;  // .bvh; empty: the built-in ones
  MotionFileOptions motion_file;               // how to read them
  std::vector<std::string> sizes;              // "STRANDSxVERTICES"; empty: as the grid says
  std::string solver;                          // empty: the built-in scene's
  ExecutorConfig device;                       // kNoDevice: the solver's double-precision version
  double seconds = 0.0;                        // recorded of each part of a motion; 0 = half a second
  bool is_quick = false;
};

inline constexpr double kStreamBoundsM[] = {2e-5, 5e-5, 1e-4, 5e-4};
/// The bound that goals are stated at.
inline constexpr double kGoalBoundM = 1e-4;
/// The first differences are not typical yet; as codec_bench.
inline constexpr size_t kStartFrames = 9;

/// One codec at one bound on one recording. Times are medians over frames.
struct StreamingRow {
  std::string motion;
  std::string moved_by;  // as the recording
  MotionLevel motion_level = MotionLevel::Idle;
  MotionPart part = MotionPart::Median;
  StreamSize size;
  std::string codec;
  bool is_ours = false;
  bool is_temporal = false;
  bool is_bound_free = false;
  double bound_m = 0.0;
  double bits = 0.0;       // per vertex and frame, after the first kStartFrames
  double all_bits = 0.0;   // the same with the first frames
  double join_bits = 0.0;  // per vertex: what somebody who joins needs
  double max_error_m = 0.0;
  double rms_error_m = 0.0;
  // Processor time of all threads of this process, and what a clock on the wall says.
  double encode_cpu_ms = 0.0;
  double encode_wall_ms = 0.0;
  double decode_cpu_ms = 0.0;
  double decode_wall_ms = 0.0;

  /// "94_01, wildest part".
  std::string motion_and_part() const { return motion + ", " + to_string(part) + " part"; }
  bool is_same_recording(const StreamingRow& other) const {
    return motion == other.motion && part == other.part && size.strand_count == other.size.strand_count &&
           size.vertex_count == other.size.vertex_count;
  }
  double mbit_per_s() const { return bits * static_cast<double>(size.vertices()) / kStreamFrameS * 1e-6; }
  /// A little room for the rounding of what was recorded to floats, half a step below 1 m.
  bool keeps_bound() const { return max_error_m <= bound_m + 0x1p-25; }
};

struct StreamingReport {
  bool is_quick = false;
  std::string device;  // as GL names it, or why there is none
  std::string solver;
  unsigned processors = 0;
  double seconds = 0.0;
  std::vector<StreamingRow> rows;
  std::vector<StreamRecording> recordings;  // without their frames
  StreamLatency latency;
};

/// Runs everything; prints progress. `on_recording` gets what is known after each recording: a run of many
/// minutes that is broken off leaves that. BadInput for options that nothing can be run for.
Result<StreamingReport> measure_streaming(const StreamingOptions& options,
                                          const std::function<Status(const StreamingReport&)>& on_recording);

/// One codec on one recording. An error names the codec.
Result<StreamingRow> measure_codec(const StreamCodecRow& codec, const StreamRecording& recording);

/// Measures and writes; prints progress and where the files are.
Status run_streaming(const StreamingOptions& options);

}  // namespace strandcast
