// Measurements of strandcast-report volume: error of a volume of hair against its time, methods of summing
// strands into it, and the state of hair after a shake for every method of using it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/scene/scene_desc.h"
#include "server/sim/executor/executor.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// Hairs from which the volume is made: guides, or all.
enum class VolumeHairs { Guides, All };
/// Returns "guides" or "all hairs".
const char* to_string(VolumeHairs hairs);

/// Settings of the true volume, which is made of all hairs.
inline constexpr uint32_t kTrueResolution = 64;
inline constexpr uint32_t kTrueSmoothing = 1;

struct VolumeStudyDesc {
  SceneDesc scene;           // all hairs that there are
  uint32_t guide_count = 0;  // those of them that are simulated where only guides are; at most all
  double seconds = 2.0;      // of the shake
  uint32_t moments = 4;      // of that, at which volumes are compared
  uint32_t rounds = 5;       // of each timing
  std::vector<uint32_t> resolutions = {16, 24, 32, 48, 64, 96, 128};
  std::vector<uint32_t> smoothings = {0, 1, 2};
  std::vector<uint32_t> intervals = {1, 2, 4};
  double shake_s = 20.0;  // of a tuft, which then is held for
  double hold_s = 35.0;   // and looked at for
  double look_s = 5.0;
  uint32_t tuft_strands = 200;
};

/// One setting of a volume, with its error.
struct VolumeError {
  uint32_t resolution = 0;
  uint32_t smoothing = 0;
  uint32_t interval = 1;  // steps that it is good for: errors are of the oldest, time is the mean
  VolumeHairs hairs = VolumeHairs::Guides;
  float cell_m = 0.0f;
  // Root mean squares at all vertices of the guides, over those of the truth.
  double density = 0.0;
  double gradient = 0.0;
  double velocity = 0.0;
  double cpu_ms = 0.0;  // of a step, median
};

/// One method of summing strands into a volume.
struct ScatterResult {
  std::string name;
  std::string what;        // it is, in words
  bool is_in_use = false;  // the simulation may do it so
  // Root mean squares over all nodes, against a sum in double.
  double density = 0.0;
  double momentum = 0.0;
  bool is_repeatable = true;  // the same bits each time, asked several times
  double lost_share = 0.0;    // of samples
  double cpu_ms = 0.0;
};

/// One method of using the volume on a tuft that is shaken, held and measured.
struct VolumeOutcome {
  std::string name;
  VolumeDesc volume;
  double speed_rms_mps = 0.0;
  double nyquist_m = 0.0;
  double volume_share = 0.0;
  double crowded_share = 0.0;
  double step_cpu_ms = 0.0;
};

struct VolumeStudy {
  uint32_t hair_count = 0;
  uint32_t guide_count = 0;
  uint32_t vertex_count = 0;
  size_t scatter_samples = 0;
  uint32_t scatter_resolution = 0;
  std::string scatter_device;  // empty: no OpenGL, and only the host's way was tried
  std::vector<VolumeError> errors;
  std::vector<ScatterResult> scatters;
  std::vector<VolumeOutcome> outcomes;
};

/// Receives a description of each part when it begins.
using VolumeProgress = std::function<void(const std::string&)>;

/// Runs the study. BadInput for an invalid scene, or for more guides than hairs.
Result<VolumeStudy> run_volume_study(const VolumeStudyDesc& desc, Executor& executor,
                                     const std::string& gl_device, const VolumeProgress& progress);

// Compares the methods of summing strands into a volume: the host's, those of OpenGL that the simulation may
// use, and those of Woodhouse 2017 (4.2.4). All compute the same volume of the same hair unsmoothed, and
// are compared with a sum in double precision.

struct ScatterStudyDesc {
  const StrandLayout& layout;
  const std::vector<glm::vec3>& position_m;    // (vertex_count x strand_count) head space
  const std::vector<glm::vec3>& velocity_mps;  // relative to the head
  uint32_t resolution = 64;
  std::string gl_device;  // as EglContext::make
  uint32_t rounds = 5;
};

/// Fills this part of the study; without OpenGL only the host's method is measured. Changes the current
/// context.
Status study_scatters(const ScatterStudyDesc& desc, VolumeStudy& study);

// Files of strandcast-report volume: CSV tables, plots and one page. Pure functions of a VolumeStudy, except
// saving.

inline constexpr const char* kVolumePage = "volume.html";

/// Returns a recommendation in some sentences.
std::string volume_summary(const VolumeStudy& study);

std::string volume_error_csv(const VolumeStudy& study);
std::string volume_scatter_csv(const VolumeStudy& study);
std::string volume_outcome_csv(const VolumeStudy& study);
/// Returns a plot of density error against the time of a step, with a line per number of smoothings and
/// choice of hairs.
std::string volume_plot(const VolumeStudy& study);
std::string volume_page(const VolumeStudy& study);

Status save_volume_study(const VolumeStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
