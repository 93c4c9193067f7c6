// What the codec "step" takes beside "tangent" on the same frames of the server's own solvers, told all of
// the wind, its mean or nothing: bits a vertex, CPU milliseconds of both sides, and the largest error. One
// thread per side.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <string_view>

#include "common/base/profile.h"
#include "server/report/stream_codec.h"
#include "server/report/stream_recording.h"
#include "server/sim/executor/lanes_executor.h"

namespace strandcast {
namespace {

struct Options {
  StreamSize size{2000, 16};
  std::string solver = "dftl";
  std::string motion;  // a .bvh file; else "active"
  double seconds = 3.0;
  double bound_m = 1e-4;
  MotionPart part = MotionPart::Median;
};

int64_t cpu_ns() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

double largest_error_m(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double largest = 0.0;
  for (size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, static_cast<double>(glm::distance(glm::dvec3(a[i]), glm::dvec3(b[i]))));
  return largest;
}

Status run(const Options& options) {
  ASSIGN_OR_RETURN(const auto executor, make_lanes_executor());
  RecordingDesc desc;
  desc.size = options.size;
  desc.seconds = options.seconds;
  desc.solver = options.solver;
  desc.executor = executor.get();
  desc.part = options.part;
  if (options.motion.find('.') == std::string::npos) {
    for (const StreamMotion& motion : built_in_stream_motions())
      if (motion.name == (options.motion.empty() ? "built-in walk" : options.motion)) desc.motion = motion;
  } else {
    ASSIGN_OR_RETURN(desc.motion, load_stream_motion(options.motion, {}));
  }
  ASSIGN_OR_RETURN(const StreamRecording recording, record_strands(desc));
  constexpr size_t kStart = 9;
  for (const StreamCodecRow& row : own_stream_codecs(options.bound_m)) {
    if (row.name != "tangent" && row.name != "step") continue;
    ASSIGN_OR_RETURN(const auto codec, row.make(recording.shape));
    double bytes = 0.0, encode_ms = 0.0, decode_ms = 0.0, error_m = 0.0;
    size_t first_bytes = 0;
    std::string start;
    for (size_t i = 0; i < recording.frames.size(); ++i) {
      RETURN_IF_ERROR(codec->take(recording.frames[i]));
      const int64_t begin_ns = cpu_ns();
      ASSIGN_OR_RETURN(const auto message, codec->encode());
      const int64_t encoded_ns = cpu_ns();
      RETURN_IF_ERROR(codec->decode(message));
      const int64_t decoded_ns = cpu_ns();
      if (i == 0) first_bytes = message.size();
      if (i > 0 && i < kStart)
        start += fmt::format(" {:.2f}", 8.0 * static_cast<double>(message.size()) /
                                            static_cast<double>(recording.shape.plane_size()));
      error_m = std::max(error_m, largest_error_m(codec->decoded(), recording.frames[i].position_in_head_m));
      if (i < kStart) continue;
      bytes += static_cast<double>(message.size());
      encode_ms += static_cast<double>(encoded_ns - begin_ns) * 1e-6;
      decode_ms += static_cast<double>(decoded_ns - encoded_ns) * 1e-6;
    }
    const int64_t join_ns = cpu_ns();
    ASSIGN_OR_RETURN(const size_t join_bytes, codec->join_bytes(recording.frames.back()));
    const double join_ms = static_cast<double>(cpu_ns() - join_ns) * 1e-6;
    const auto frames = static_cast<double>(recording.frames.size() - kStart);
    const auto vertices = static_cast<double>(recording.shape.plane_size());
    fmt::print(
        "{:12} {:>7.4f} bits/vertex {:>8.3f} Mbit/s encode {:>6.2f} ms decode {:>6.2f} ms error {:.4f} mm "
        "keyframe {:.1f} bits/vertex, then{}; join {:.1f} bits/vertex {:.1f} ms\n",
        row.wind ? fmt::format("{} {}", row.name, to_string(*row.wind)) : row.name,
        8.0 * bytes / frames / vertices, 8.0 * bytes / frames * 60e-6, encode_ms / frames, decode_ms / frames,
        1e3 * error_m, 8.0 * static_cast<double>(first_bytes) / vertices, start,
        8.0 * static_cast<double>(join_bytes) / vertices, join_ms);
  }
  return {};
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  using namespace strandcast;
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    const std::string value = argv[i + 1];
    if (name == "--solver") options.solver = value;
    if (name == "--motion") options.motion = value;
    if (name == "--seconds") options.seconds = std::stod(value);
    if (name == "--bound-mm") options.bound_m = 1e-3 * std::stod(value);
    if (name == "--part" && value == "wildest") options.part = MotionPart::Wildest;
    if (name == "--size" &&
        std::sscanf(value.c_str(), "%ux%u", &options.size.strand_count, &options.size.vertex_count) != 2)
      return 2;
  }
  if (const Status status = run(options); !status) {
    fmt::print(stderr, "{}\n", status.error().to_string());
    return 2;
  }
  return 0;
}
