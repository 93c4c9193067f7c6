#include "client/app/hair_origin.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <utility>

#include "client/app/save_scene.h"
#include "common/base/profile.h"
#include "common/client/attempts.h"
#include "common/scene/file_groom.h"
#include "common/strands/asset/lattice.h"

namespace strandcast {
namespace {

constexpr float kSameRootM = 1e-4f;
constexpr std::chrono::milliseconds kSceneWait{100};

/// How a place in the head's space gets back to where the file has it.
glm::dmat4 file_from_head_of(const GroomPlacement& placement) {
  glm::dmat3 head_from_file(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    glm::vec3 unit(0.0f);
    unit[axis] = 1.0f;
    head_from_file[axis] = glm::dvec3(placement.turn(unit));
  }
  const auto unit_m = static_cast<double>(placement.unit_m);
  const glm::dmat3 turn = glm::transpose(head_from_file) / unit_m;
  glm::dmat4 file_from_head(turn);
  file_from_head[3] = glm::dvec4(-(turn * glm::dvec3(placement.place(glm::vec3(0.0f)))), 1.0);
  return file_from_head;
}

/// The number that a text says, which a float is near: 0.01, not 0.00999999978.
double as_written(float number) {
  const std::string text = fmt::format("{}", number);
  double written = 0.0;
  std::from_chars(text.data(), text.data() + text.size(), written);
  return written;
}

/// Values of strands in the order in which they are simulated.
template <class T>
std::vector<T> in_order(const std::vector<T>& values, const std::vector<uint32_t>& order) {
  std::vector<T> ordered;
  for (size_t i = 0; !values.empty() && i < order.size(); ++i) ordered.push_back(values[order[i]]);
  return ordered;
}

HairOrigin origin_of(const GroomPlacement& placement, std::shared_ptr<const ExportOrigin> strands) {
  return {std::move(strands), as_written(placement.unit_m), placement.is_z_up, file_from_head_of(placement)};
}

Status check_same(const FileGroom& hair, const SceneAsset& asset) {
  const Groom& groom = hair.placed.groom;
  if (groom.strand_count() != asset.strand_count || groom.uniform_vertex_count() != asset.vertex_count)
    return make_error(ErrorCode::BadInput, "{} strands x {} vertices, but {} x {} are simulated: other hair",
                      groom.strand_count(), groom.uniform_vertex_count(), asset.strand_count,
                      asset.vertex_count);
  for (uint32_t strand = 0; strand < asset.strand_count; ++strand)
    if (glm::distance(groom.rest_position_m[groom.offset[hair.order[strand]]],
                      asset.rest_position_m[strand]) > kSameRootM)
      return make_error(ErrorCode::BadInput,
                        "strand {} has its root elsewhere than what is simulated: other hair",
                        hair.order[strand]);
  return {};
}

/// The rest points of the files, where what is simulated are these, rounded as by load_scene_content(): hair
/// of another length or curl has none there.
std::vector<glm::vec3> own_rest_points(const FileGroom& hair, const SceneAsset& asset) {
  const Groom& groom = hair.placed.groom;
  std::vector<glm::vec3> points;
  points.reserve(asset.rest_position_m.size());
  for (uint32_t vertex = 0; vertex < asset.vertex_count; ++vertex)
    for (const uint32_t strand : hair.order)
      points.push_back(groom.rest_position_m[groom.offset[strand] + vertex]);
  std::vector<glm::vec3> rounded = points;
  round_to_lattice(rounded, kRestStepBits);
  return rounded == asset.rest_position_m ? points : std::vector<glm::vec3>();
}

/// Sentences of what was assumed of curves as motion.
std::vector<std::string> notes_of(const CurveMotion& motion, const HairOrigin& origin) {
  std::vector<std::string> notes = {
      fmt::format(
          "the head goes as {} roots of {} curves object{} do, which move as one: it has no joints of a "
          "body",
          motion.root_count, motion.object_count, motion.object_count == 1 ? "" : "s"),
      fmt::format("one unit is taken as {:.4g} m and +{} as up, as of the hair that it moves", origin.unit_m,
                  origin.is_z_up ? 'Z' : 'Y')};
  if (motion.is_behind_rest)
    notes.emplace_back("its first sample is the rest shape, and the motion begins with the next");
  return notes;
}

/// How many even steps follow these times: one for each, or none longer than the shortest between two.
uint64_t even_steps(const std::vector<double>& time_s) {
  constexpr double kEven = 0.99, kRounding = 1e-6;
  const auto count = static_cast<double>(time_s.size() - 1);
  double shortest_s = time_s.back();
  for (size_t i = 1; i < time_s.size(); ++i) shortest_s = std::min(shortest_s, time_s[i] - time_s[i - 1]);
  if (shortest_s > kEven * time_s.back() / count) return time_s.size() - 1;
  const double most = std::min(time_s.back() / shortest_s, static_cast<double>(kMaxCurveMotionSamples));
  return static_cast<uint64_t>(std::ceil(most - kRounding));
}

}  // namespace

Result<HairOrigin> load_origin(const FileGroomDesc& file, const SceneAsset& asset) {
  ASSIGN_OR_RETURN(const FileGroom hair, load_file_groom(file));
  if (const Status same = check_same(hair, asset); !same) return at(file.path.string(), same.error());
  const StrandLabels& labels = hair.placed.labels;
  auto strands = std::make_shared<ExportOrigin>();
  strands->place = hair.order;
  strands->id = in_order(labels.id, hair.order);
  strands->group = in_order(labels.group, hair.order);
  strands->object = in_order(labels.object, hair.order);
  strands->object_name = labels.object_name;
  strands->root_uv = in_order(hair.placed.groom.root_uv, hair.order);
  strands->material = hair.placed.material;
  for (size_t i = 0; !labels.width.empty() && i < hair.order.size(); ++i) {
    const auto first = labels.width.begin() + hair.placed.groom.offset[hair.order[i]];
    strands->width_m.insert(strands->width_m.end(), first, first + asset.vertex_count);
  }
  strands->rest_position_m = own_rest_points(hair, asset);
  return origin_of(hair.placed.placement, std::move(strands));
}

Result<HairOrigin> load_place(const FileGroomDesc& file) {
  ASSIGN_OR_RETURN(const FileGroom hair, load_file_groom(file));
  return origin_of(hair.placed.placement, nullptr);
}

MotionFile head_motion(const CurveMotion& motion, const HairOrigin& origin, const std::string& name,
                       const MotionFileOptions& options) {
  MotionFile file;
  for (const std::string& note : notes_of(motion, origin))
    file.notes.push_back(fmt::format("{}: {}", name, note));
  const glm::dmat4 head_from_file = glm::inverse(origin.file_from_head);
  const glm::dquat turn = glm::normalize(glm::quat_cast(glm::dmat3(head_from_file) / origin.unit_m));
  const auto head_in_file = glm::dvec3(origin.file_from_head[3]);
  const uint64_t step_count = even_steps(motion.time_s);
  file.clip.file_unit_m = origin.unit_m;
  file.clip.up = origin.is_z_up ? "+Z" : "+Y";
  file.clip.frame_s = motion.duration_s() / static_cast<double>(step_count);
  for (uint64_t i = 0; i <= step_count; ++i) {
    const Pose moved = motion.sample(file.clip.frame_s * static_cast<double>(i));
    file.clip.world_from_head.push_back({glm::dvec3(head_from_file * glm::dvec4(moved * head_in_file, 1.0)),
                                         turn * moved.rotation * glm::conjugate(turn)});
  }
  judge_frames(file, name, options);
  return file;
}

Result<SceneDesc> ask_scene(const CtlTarget& target) {
  ASSIGN_OR_RETURN(ClientConfig config, client_config_for(target, Role::Controller));
  config.hello.gets_no_stream = true;
  ASSIGN_OR_RETURN(const auto client, connect_patiently(config));
  RETURN_IF_ERROR(client->send(SceneRequest{}));
  const int64_t begin_ns = now_ns();
  while (now_ns() - begin_ns < std::chrono::nanoseconds(kCommandPatience).count())
    for (const ClientEvent& event : client->wait(kSceneWait)) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
      if (const auto* text = std::get_if<SceneText>(&event)) {
        ASSIGN_OR_RETURN(SceneDesc scene, scene_of(*text));
        for (SceneDesc& head : scene.heads)
          if (head.name == target.head) return std::move(head);
        return scene;
      }
    }
  return make_error(ErrorCode::Timeout, "the server did not say its scene");
}

}  // namespace strandcast
