#include "server/report/cycles_run.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "common/base/file.h"
#include "server/report/report_files.h"

namespace strandcast {
namespace {

constexpr uint64_t kMostRawBytes = 256u << 20;
constexpr uint64_t kMostLogBytes = 64u << 20;
constexpr size_t kRawColors = 4;
// The hair of truths, whatever the weights of our own shading are: how wide its highlight is, how far its
// scales tilt, and how rough it is across, for which the fit of absorption to colour was made.
constexpr double kTruthWidthRad = 7.5 * 3.14159265358979 / 180.0;
constexpr double kTruthTiltRad = 3.5 * 3.14159265358979 / 180.0;
constexpr double kTruthAcross = 0.3;
constexpr double kWetWidth = 0.5;  // wet hair's highlight is sharper by this

/// Roughness along the hair of whose lobe the sum of sines deviates by twice the width: Chiang et al. 2016,
/// equation 7, without its term of the twentieth power, which is nothing for hair.
double roughness_along(double wetness) {
  constexpr double kLinear = 0.726;
  constexpr double kSquare = 0.812;
  const double deviation = 2.0 * kTruthWidthRad * (1.0 - kWetWidth * wetness);
  return (std::sqrt(kLinear * kLinear + 4.0 * kSquare * deviation) - kLinear) / (2.0 * kSquare);
}

template <class T>
void put(std::vector<std::byte>& bytes, const T& value) {
  const auto* const begin = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

std::vector<std::byte> strand_bytes(const DrawnStrands& strands) {
  std::vector<std::byte> bytes;
  for (uint32_t s = 0; s < strands.strand_count(); ++s)
    put(bytes, strands.first_point[s + 1] - strands.first_point[s]);
  for (size_t i = 0; i < strands.position_m.size(); ++i) {
    put(bytes, strands.position_m[i]);
    put(bytes, 0.5f * strands.width_m[i]);
    put(bytes, strands.color[i]);
  }
  return bytes;
}

std::vector<std::byte> mesh_bytes(const Mesh& mesh) {
  std::vector<std::byte> bytes;
  for (const glm::vec3& position : mesh.position_m) put(bytes, position);
  for (const glm::uvec3& triangle : mesh.triangle) put(bytes, triangle);
  return bytes;
}

std::string json_of(const glm::vec3& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

std::string json_of(const CyclesJob& job, const CyclesSettings& settings) {
  const LookDesc& look = job.scene->look;
  const CameraDesc& camera = job.scene->camera;
  return fmt::format(
      R"({{"name": "{0}", "strands": "{0}.strands", "head": "{0}.head", "light": "{0}.light", {1})"
      R"("counts": {{"strands": {2}, "points": {3}, "head_vertices": {4}, "head_triangles": {5}}}, )"
      R"("camera": {{"position": {6}, "target": {7}, "fov_y_rad": {8}, "width": {9}, "height": {10}}}, )"
      R"("suns": [{{"direction": {11}, "color": {12}}}, {{"direction": {13}, "color": {14}}}], "sky": {15}, )"
      R"("hair": {{"roughness": {16}, "radial_roughness": {17}, "tilt_rad": {18}}}, "skin": {19}, )"
      R"("samples": {20}, "seed": {21}, "threads": {22}}})",
      job.name, job.has_cover ? fmt::format(R"("cover": "{}.cover", )", job.name) : std::string(),
      job.strands->strand_count(), job.strands->position_m.size(), job.head->position_m.size(),
      job.head->triangle.size(), json_of(camera.target_m + camera.offset_m), json_of(camera.target_m),
      camera.fov_y_rad, job.size.width, job.size.height, json_of(look.light_direction),
      json_of(look.exposure * look.light_color), json_of(look.rim_direction),
      json_of(look.exposure * look.rim_color), look.exposure * look.ambient,
      roughness_along(look.shading.wetness), kTruthAcross, kTruthTiltRad, json_of(look.skin_color),
      job.samples > 0 ? job.samples : settings.samples, job.seed, settings.threads);
}

/// Starts a program with its output in a file and waits for its end.
Status run_program(std::vector<std::string> words, const std::filesystem::path& log) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr mode_t kReadable = 0644;
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   kReadable);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t process = 0;
  const int failure =
      posix_spawnp(&process, words.front().c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0)
    return make_error(ErrorCode::NotFound, "cannot start {}: {} (deploy/install_deps.sh blender installs it)",
                      words.front(), std::strerror(failure));
  int state = 0;
  if (waitpid(process, &state, 0) != process || !WIFEXITED(state) || WEXITSTATUS(state) != 0)
    return make_error(ErrorCode::Internal, "{} failed; {} has what it said", words.front(), log.string());
  return {};
}

/// Means of one plane of a raw picture over the cells; `channels` are the first of four.
Result<std::vector<glm::vec3>> raw_cells(const std::filesystem::path& path, RenderSize size) {
  ASSIGN_OR_RETURN(const auto bytes, load_file(path, kMostRawBytes));
  if (bytes.size() != size_t{size.width} * size.height * kRawColors * sizeof(float))
    return at(path.string(), make_error(ErrorCode::Internal, "{} bytes are no such picture", bytes.size()));
  const uint32_t across = size.width / kCellPx;
  std::vector<glm::vec3> cells(size_t{across} * (size.height / kCellPx), glm::vec3(0.0f));
  for (uint32_t y = 0; y < size.height; ++y)
    for (uint32_t x = 0; x < size.width; ++x) {
      glm::vec3 color;
      std::memcpy(&color, &bytes[(size_t{y} * size.width + x) * kRawColors * sizeof(float)], sizeof color);
      cells[size_t{y / kCellPx} * across + x / kCellPx] += color / static_cast<float>(kCellPx * kCellPx);
    }
  return cells;
}

}  // namespace

Result<CyclesRun> CyclesRun::make(const std::filesystem::path& folder, const CyclesSettings& settings) {
  RETURN_IF_ERROR(make_report_folder(folder));
  CyclesRun run;
  run.folder_ = folder;
  run.settings_ = settings;
  return run;
}

Status CyclesRun::add(const CyclesJob& job) {
  RETURN_IF_ERROR(save_file(folder_ / (job.name + ".strands"), strand_bytes(*job.strands)));
  RETURN_IF_ERROR(save_file(folder_ / (job.name + ".head"), mesh_bytes(*job.head)));
  jobs_ += (jobs_.empty() ? "" : ",\n") + json_of(job, settings_);
  added_.push_back({job.name, job.size, job.has_cover});
  return {};
}

Status CyclesRun::run() {
  const std::filesystem::path jobs = folder_ / "jobs.json";
  RETURN_IF_ERROR(save_text(jobs, "[" + jobs_ + "]\n"));
  return run_program({settings_.program, "-b", "-noaudio", "--factory-startup", "--python-exit-code", "1",
                      "-P", settings_.script.string(), "--", jobs.string()},
                     folder_ / "log.txt");
}

Result<CyclesPicture> CyclesRun::picture(const std::string& name) const {
  const auto added =
      std::find_if(added_.begin(), added_.end(), [&](const Added& one) { return one.name == name; });
  if (added == added_.end()) return make_error(ErrorCode::NotFound, "{} was not drawn", name);
  CyclesPicture picture;
  const uint32_t width = added->size.width / kCellPx;
  const uint32_t height = added->size.height / kCellPx;
  ASSIGN_OR_RETURN(auto light, raw_cells(folder_ / (name + ".light"), added->size));
  picture.truth.light = {width, height, std::move(light)};
  if (added->has_cover) {
    ASSIGN_OR_RETURN(const auto cover, raw_cells(folder_ / (name + ".cover"), added->size));
    picture.truth.cover = {width, height, {}, {}};
    for (const glm::vec3& shares : cover) {
      picture.truth.cover.hair.push_back(shares.x);
      picture.truth.cover.skin.push_back(shares.y);
    }
  }
  ASSIGN_OR_RETURN(const std::string log, load_text(folder_ / "log.txt", kMostLogBytes));
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    const std::string begin = "CYCLES " + name + " ";
    if (line.starts_with(begin)) picture.cpu_s = std::strtod(line.c_str() + begin.size(), nullptr);
  }
  return picture;
}

}  // namespace strandcast
