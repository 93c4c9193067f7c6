// Prints, as a Markdown table, what the GPU takes for a step of every strand model, for the volume, for
// reading strands back and for drawing them, how many bytes that has to move at least, and what share of the
// memory's own speed it gets. That speed is measured first, by copying a large buffer in the same context.
//   gpu_bench [--device hardware] [--strands N] [--vertices N] [--size WxH] [--rounds N]
// Milliseconds are medians by the device's own timer; on a software device, by the clock. Bytes are counted,
// not measured: of a step what its model's planes hold, read once and written once; of the volume positions
// and motions once and its nodes twice; of a picture what its passes keep, written once and read once.
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "common/base/check.h"
#include "common/base/quantile.h"
#include "common/gl/egl_context.h"
#include "common/gl/timer.h"
#include "common/groom/groom_asset.h"
#include "common/render/render_device.h"
#include "server/scene/scene_content.h"
#include "server/sim/executor/gl_executor.h"
#include "server/sim/solver_registry.h"
#include "server/sim/volume/volume_forces.h"
#include "tests/support/sim_scene.h"

namespace strandcast {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr uint64_t kPlaneBytes = sizeof(glm::vec4);  // of a vertex

struct Options {
  std::string device = "hardware";
  uint32_t strands = 100'000;
  uint32_t vertices = 32;
  RenderSize size{1920, 1080};
  int rounds = 30;
};

/// A line of the table.
struct Row {
  std::string part;
  std::string what;
  double ms = 0.0;
  uint64_t bytes = 0;
  bool is_in_memory = true;  // false: over the bus, where the memory's speed says nothing
};

class Table {
 public:
  explicit Table(double bytes_per_s) : bytes_per_s_(bytes_per_s) {
    fmt::print("| part | what | ms | MB moved | GB/s | of the memory |\n|---|---|---:|---:|---:|---:|\n");
  }
  void add(const Row& row) const {
    const double speed = static_cast<double>(row.bytes) / (row.ms * 1e-3);
    fmt::print("| {} | {} | {:.3f} | {:.1f} | {:.1f} | {} |\n", row.part, row.what, row.ms,
               static_cast<double>(row.bytes) * 1e-6, speed * 1e-9,
               row.is_in_memory ? fmt::format("{:.0f} %", 100.0 * speed / bytes_per_s_) : "-");
    std::fflush(stdout);
  }

 private:
  double bytes_per_s_;
};

template <class Measure>
double median_of(int rounds, Measure measure) {
  std::vector<double> ms;
  for (int i = 0; i <= rounds; ++i) {
    const double one_ms = measure();
    if (i > 0) ms.push_back(one_ms);  // the first one compiles and allocates
  }
  return median(std::move(ms));
}

/// Bytes a second of a copy within the device's memory, reads and writes counted.
double measure_copy_speed(Executor& executor, bool is_software, int rounds) {
  const GLsizeiptr bytes = GLsizeiptr{is_software ? 32 : 512} << 20;
  GLuint buffers[2] = {};
  glCreateBuffers(2, buffers);
  for (const GLuint buffer : buffers) {
    glNamedBufferStorage(buffer, bytes, nullptr, 0);
    const float zero = 0.0f;
    glClearNamedBufferData(buffer, GL_R32F, GL_RED, GL_FLOAT, &zero);
  }
  const double ms = median_of(rounds, [&] {
    return timed_ms(executor, [&] { glCopyNamedBufferSubData(buffers[0], buffers[1], 0, 0, bytes); });
  });
  glDeleteBuffers(2, buffers);
  return 2.0 * static_cast<double>(bytes) / (ms * 1e-3);
}

/// Of a step: rest shape and colliders' head read, position and velocity read and written, and what the model
/// keeps beside them, read and written.
uint64_t bytes_of_step(const Solver& solver, uint64_t vertices) {
  const uint64_t kept = std::max<uint64_t>(solver.memory_bytes(), 3 * kPlaneBytes * vertices);
  return 2 * kept - kPlaneBytes * vertices;  // the rest shape is not written
}

Status time_solvers(Executor& executor, const Options& options, const Groom& groom, const Table& table) {
  for (const SolverRow& row : solver_table()) {
    if (!row.has_kernel) continue;
    SceneFeatures features;
    features.has_colliders = features.has_follicle_limit = true;
    ASSIGN_OR_RETURN(const auto solver,
                     row.make(complete_parameters(row, {}).value(), {&executor, features}));
    RETURN_IF_ERROR(solver->load(groom, {1.0, 0.0, 0.0, 0.0}));
    int step = 0;
    const double ms = median_of(options.rounds, [&] {
      StepInput input = moving_input(++step, kSubstepS);
      input.follicle_limit_rad = 0.35;
      return timed_ms(executor, [&] { solver->substep(input); });
    });
    table.add({"step", row.name, ms, bytes_of_step(*solver, groom.rest_position_m.size())});
    if (row.name != solver_table().front().name) continue;
    SolverState state;
    const double read_ms =
        median_of(options.rounds, [&] { return timed_ms(executor, [&] { solver->read(state); }); });
    table.add({"read-back", "positions and velocities", read_ms,
               2 * kPlaneBytes * groom.rest_position_m.size(), false});
  }
  return {};
}

Status time_volume(Executor& executor, const Options& options, const Groom& groom, const Table& table) {
  ASSIGN_OR_RETURN(const StrandLayout layout, make_strand_layout(groom));
  ASSIGN_OR_RETURN(const HairVolume host,
                   HairVolume::make({layout.strand_count, layout.vertex_count, layout.rest, {}}, {64, 1}));
  StepBlock step{};
  step.world_from_head = {glm::vec4(1, 0, 0, 0), glm::vec4(0, 1, 0, 0), glm::vec4(0, 0, 1, 0)};
  step.head_velocity.w = static_cast<float>(kSubstepS);
  step.shape = {layout.strand_count, layout.vertex_count, 1u, layout.vertex_count};
  const auto position = executor.make_plane("position", layout.strand_count, layout.rest);
  const auto velocity = executor.make_plane("velocity", layout.strand_count,
                                            std::vector<glm::vec4>(layout.size(), glm::vec4(0.0f)));
  ASSIGN_OR_RETURN(const auto nodes,
                   executor.make_table("volume", static_cast<uint32_t>(2 + host.most_nodes())));
  for (const char* scatter : {"sort", "atomics"}) {
    DeviceVolumeDesc desc;
    desc.scatter = scatter;
    desc.volume = &host;
    desc.strand_count = layout.strand_count;
    desc.vertex_count = layout.vertex_count;
    ASSIGN_OR_RETURN(const auto volume, executor.make_volume(desc));
    const double ms = median_of(options.rounds, [&] {
      return timed_ms(executor, [&] { volume->update(step, *position, *velocity, *nodes); });
    });
    table.add({"volume", scatter, ms, 2 * kPlaneBytes * layout.size() + 2 * nodes->size_bytes()});
  }
  return {};
}

/// In a context of its own, as the server's frame thread has one.
Status time_drawing(const Options& options, const Table& table) {
  SceneDesc scene = built_in_scene();
  ProceduralGroomDesc groom;
  groom.strand_count = options.strands;
  groom.vertex_count = options.vertices;
  scene.groom = groom;
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(scene));
  const SceneAsset asset = make_scene_asset(content.groom, std::move(content.head));
  ASSIGN_OR_RETURN(const auto context, gl::EglContext::make(options.device));
  const std::string size = fmt::format("{}x{}", options.size.width, options.size.height);
  for (const RenderPath* path : {&tile_path(), &segment_path()}) {
    ASSIGN_OR_RETURN(const auto renderer,
                     Renderer::make(gl::ShaderLibrary(), context->info(), asset, scene.look, *path));
    gl::GpuTimer timer(context->info());
    Status status;
    const double ms = median_of(options.rounds, [&] {
      timer.begin();
      status = renderer->draw({{}, asset.rest_position_m}, scene.camera, options.size);
      return timer.end_ms();
    });
    RETURN_IF_ERROR(status);
    table.add({"drawing", fmt::format("{}, {}", path->name, size), ms, 2 * renderer->passes().live_bytes()});
    for (const gl::PassReport& pass : renderer->passes().report())
      if (pass.fate == gl::PassFate::Kept && pass.runs > 0)
        table.add({"", pass.name, pass.median_ms, 2 * pass.size_bytes});
    const double read_ms = median_of(options.rounds, [&] {
      timer.begin();
      (void)renderer->read_image();
      return timer.end_ms();
    });
    table.add(
        {"read-back", "a picture", read_ms, uint64_t{4} * options.size.width * options.size.height, false});
  }
  return {};
}

Status run(const Options& options) {
  double bytes_per_s = 0.0;
  {
    ASSIGN_OR_RETURN(const auto executor, make_gl_executor(options.device));
    bytes_per_s = measure_copy_speed(*executor, executor->info().is_software, options.rounds);
    fmt::print("{}; {} strands of {} vertices; its memory copies {:.1f} GB/s, reads and writes counted\n\n",
               executor->info().name, options.strands, options.vertices, bytes_per_s * 1e-9);
    const Table table(bytes_per_s);
    TestGroomDesc desc;
    desc.strand_count = options.strands;
    desc.vertex_count = options.vertices;
    const Groom groom = make_test_groom(desc);
    RETURN_IF_ERROR(time_solvers(*executor, options, groom, table));
    RETURN_IF_ERROR(time_volume(*executor, options, groom, table));
    RETURN_IF_ERROR(time_drawing(options, table));
  }
  return {};
}

Result<Options> parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view name = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    const auto number = static_cast<uint32_t>(std::max(0, std::atoi(value.c_str())));
    if (name == "--device" && !value.empty()) {
      options.device = value;
    } else if (name == "--strands" && number > 0) {
      options.strands = number;
    } else if (name == "--vertices" && number > 0) {
      options.vertices = number;
    } else if (name == "--rounds" && number > 0) {
      options.rounds = static_cast<int>(number);
    } else if (name != "--size" ||
               std::sscanf(value.c_str(), "%ux%u", &options.size.width, &options.size.height) != 2) {
      return make_error(
          ErrorCode::BadInput,
          "what is '{} {}'? (known: --device NAME --strands N --vertices N --size WxH --rounds N)", name,
          value);
    }
  }
  return options;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  using namespace strandcast;
  const auto options = parse(argc, argv);
  const Status status = options ? run(*options) : Status(options.error());
  if (status) return 0;
  fmt::print(stderr, "gpu_bench: {}\n", status.error().to_string());
  return 2;
}
