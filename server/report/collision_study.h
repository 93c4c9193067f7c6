// Measurements of strandcast-report collisions: methods that keep hair out of the head, and its responses to
// a moving body, each by penetration depth against time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/groom/distance_field.h"
#include "common/motion/motion_file.h"
#include "common/pictures/image_codec.h"
#include "common/scene/scene_desc.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Resolution of the distance field that measures the penetration for all methods.
inline constexpr uint32_t kTrueFieldResolution = kMaxFieldResolution;

struct CollisionStudyDesc {
  SceneDesc scene;  // its groom, head and solver
  std::vector<uint32_t> resolutions = {16, 32, 48, 64, 96, 128};
  int shake_steps = 60;            // at 60 Hz, of 10 g
  int rest_steps = 300;            // until the head's hair has settled
  std::filesystem::path clip;      // .bvh with the usual joints; empty: a body made up here
  MotionFileOptions clip_options;  // how to read it
  int body_steps = 300;
  int body_rest_steps = 600;
  bool has_pictures = true;
};

/// Penetration in metres, relative to the clearance of the loaded hair.
struct CollisionDepth {
  double vertex_most_m = 0.0;
  double vertex_usual_m = 0.0;  // of all vertices and steps, 99.9 % are less deep
  double middle_most_m = 0.0;
};

/// One method of keeping hair out of the head.
struct HeadCollision {
  std::string name;
  uint32_t resolution = 0;  // of a field; 0 = none
  double cell_m = 0.0;
  double load_ms = 0.0;  // a scene with it, all else included
  double step_cpu_ms = 0.0;
  double extra_cpu_ms = 0.0;  // over a step without the head
  CollisionDepth shaken;      // in the true field
  CollisionDepth settled;     // likewise
  double mesh_m = 0.0;        // settled: deepest vertex in the mesh itself that was outside as loaded
  double rest_speed_mps = 0.0;
};

/// One response of hair to the body.
struct BodyAnswer {
  std::string name;
  double step_cpu_ms = 0.0;
  double extra_cpu_ms = 0.0;  // over a step without the body
  CollisionDepth depth;       // in the body
  double stretch = 0.0;       // largest relative change of a segment's length
  double rest_speed_mps = 0.0;
  double carried_share = 0.0;  // of a belt's way, by lying tips, with a friction of 1
};

struct CollisionStudy {
  std::string solver, device, body_name;
  uint32_t strand_count = 0, vertex_count = 0;
  std::vector<HeadCollision> head;
  double fastest_mps = 0.0;  // end of a capsule
  std::vector<BodyAnswer> body;
  Image moments;  // of the first answer; empty without pictures
};

/// Receives a description of each part when it begins.
using CollisionProgress = std::function<void(const std::string&)>;

/// Runs the study. BadInput for a scene without a head to collide with, or with a solver without a kernel;
/// NotFound for the clip.
Result<CollisionStudy> run_collision_study(const CollisionStudyDesc& desc, Executor& executor,
                                           const CollisionProgress& progress);

/// Run the parts of the study; `study` must already contain solver and counts.
Status measure_head_collisions(const CollisionStudyDesc& desc, Executor& executor,
                               const CollisionProgress& progress, CollisionStudy& study);
Status measure_body_answers(const CollisionStudyDesc& desc, Executor& executor,
                            const CollisionProgress& progress, CollisionStudy& study);

// Files of strandcast-report collisions: CSV tables, plots and one page. Pure functions of a CollisionStudy,
// except saving.

inline constexpr const char* kCollisionPage = "collisions.html";

/// Returns a recommendation in some sentences.
std::string collision_summary(const CollisionStudy& study);

std::string head_collision_csv(const CollisionStudy& study);
std::string body_answer_csv(const CollisionStudy& study);
/// Returns a plot of penetration into the head against the time of a step.
std::string head_collision_plot(const CollisionStudy& study);
/// Returns a plot of penetration into the body against the time of a step.
std::string body_answer_plot(const CollisionStudy& study);
std::string collision_page(const CollisionStudy& study);

Status save_collision_study(const CollisionStudy& study, const std::filesystem::path& folder);

}  // namespace strandcast
