// strandcast-report streaming: compares error, bytes and milliseconds of every strand codec and of general
// codecs on the same frames. This header defines the measurements; streaming_page.h writes them to files.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "server/report/stream_codec.h"
#include "server/report/stream_latency.h"
#include "server/report/stream_playout.h"
#include "server/report/stream_recording.h"
#include "server/report/stream_view.h"

namespace strandcast {

struct StreamingOptions {
  std::filesystem::path out;                   // folder of the CSV, plots and page
  std::vector<std::filesystem::path> motions;  // .bvh; empty: the built-in ones
  MotionFileOptions motion_file;               // how to read them
  std::filesystem::path clips;                 // folder of stream_clips(), beside the built-in motions
  std::vector<std::string> sizes;              // "STRANDSxVERTICES"; empty: as the grid says
  std::vector<std::string> solvers;            // empty: the built-in scene's, and two others beside it
  ExecutorConfig device;                       // kNoDevice: the solver's double-precision version
  double seconds = 0.0;                        // recorded of each part of a motion; 0 = half a second
  std::string view;  // "WIDTHxHEIGHT" of the pictures that are compared; empty likewise
  bool is_quick = false;
};

inline constexpr double kStreamBoundsM[] = {2e-5, 5e-5, 1e-4, 2e-4, 5e-4};
/// Bound for which the goals are stated.
inline constexpr double kGoalBoundM = 1e-4;

/// One recording, made once for all codecs.
struct StreamCase {
  size_t motion = 0;  // index
  std::string solver;
  StreamSize size;
  MotionPart part = MotionPart::Median;
  bool has_peers = false;           // beside our own codecs, at the goals' bound
  bool has_curve_of_peers = false;  // and at all bounds
};
/// Returns the recordings: both parts of every motion, with the first solver at every size and beside peers,
/// with other solvers at the first size. Our codecs run on each at every bound, those that predict by steps
/// once for each of kWindsTold. Peers run at every bound on the first case of each level and size.
std::vector<StreamCase> stream_cases(const std::vector<MotionLevel>& motion_levels,
                                     const std::vector<std::string>& solvers,
                                     const std::vector<StreamSize>& sizes);

/// One codec at one bound on one recording. Times are medians over frames.
struct StreamingRow {
  std::string motion;
  std::string moved_by;  // as the recording
  MotionLevel motion_level = MotionLevel::Idle;
  MotionPart part = MotionPart::Median;
  std::string solver;
  StreamSize size;
  std::string codec;
  std::string wind;  // what it is told of it: "known", "mean", "unknown"; empty: it does not ask
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

  /// Returns motion and part as text: "94_01, wildest part".
  std::string motion_and_part() const { return motion + ", " + to_string(part) + " part"; }
  /// Returns codec and wind as text: "tangent", "step, wind mean".
  std::string codec_and_wind() const { return wind.empty() ? codec : codec + ", wind " + wind; }
  bool is_same_recording(const StreamingRow& other) const {
    return motion == other.motion && part == other.part && solver == other.solver &&
           size.strand_count == other.size.strand_count && size.vertex_count == other.size.vertex_count;
  }
  double mbit_per_s() const { return bits * static_cast<double>(size.vertices()) / kStreamFrameS * 1e-6; }
  /// Returns whether the bound was kept; allows for rounding of the recording to floats, half a unit in the
  /// last place below 1 m.
  bool keeps_bound() const { return max_error_m <= bound_m + 0x1p-25; }
};

struct StreamingReport {
  bool is_quick = false;
  std::string device;                   // as GL names it, or why there is none
  std::string solver;                   // the first: goals and plots are of it
  std::vector<std::string> clip_notes;  // which clips there were
  unsigned processors = 0;
  double seconds = 0.0;
  std::vector<StreamingRow> rows;
  std::vector<StreamRecording> recordings;  // without their frames
  StreamLatency latency;
  StreamView view;
  std::vector<PlayoutRow> playout;
  std::string playout_note;  // a head that it lacks
};

/// Runs everything and prints progress. `on_recording` gets the results so far after each recording, so that
/// an interrupted run leaves them. BadInput for options that leave nothing to run.
Result<StreamingReport> measure_streaming(const StreamingOptions& options,
                                          const std::function<Status(const StreamingReport&)>& on_recording);

/// Measures one codec on one recording; an error names the codec.
Result<StreamingRow> measure_codec(const StreamCodecRow& codec, const StreamRecording& recording);

/// Measures, writes the files, and prints progress and their location.
Status run_streaming(const StreamingOptions& options);

}  // namespace strandcast
