// How long it takes to show any second of a recording: from the keyframe before it, all frames decoded up to
// it. Prints the median, the slowest and which that was; reports and decides nothing.
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <random>
#include <utility>
#include <vector>

#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/record/recording_reader.h"
#include "common/record/strand_frames.h"

namespace strandcast {
namespace {

/// Milliseconds until the first state at or behind the second is there.
Result<double> show(RecordingReader& reader, StrandDecoder& decoder, int64_t second) {
  const int64_t begin_ns = now_ns();
  RETURN_IF_ERROR(reader.seek(second * kSInNs));
  while (true) {
    ASSIGN_OR_RETURN(const auto item, reader.next());
    if (!item) break;
    const auto& frame = std::get<RecordedFrame>(item->what).frame;
    ASSIGN_OR_RETURN(const auto state, decoder.decode(frame->message));
    if (state->sim_time_ns >= second * kSInNs) break;
  }
  return static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
}

int run(const char* path) {
  const int64_t begin_ns = now_ns();
  const auto reader = RecordingReader::open(std::filesystem::path(path), RecordedPart::Frames);
  if (!reader) return fmt::print(stderr, "{}\n", reader.error().to_string()), 2;
  auto decoder = make_recorded_decoder(**reader);
  if (!decoder) return fmt::print(stderr, "{}\n", decoder.error().to_string()), 2;
  const double open_ms = static_cast<double>(now_ns() - begin_ns) * kMsPerNs;
  std::vector<int64_t> seconds;
  const RecordingInfo& info = (*reader)->info();
  for (int64_t s = info.first_sim_time_ns / kSInNs; s * kSInNs <= info.last_sim_time_ns; ++s)
    seconds.push_back(s);
  std::shuffle(seconds.begin(), seconds.end(), std::mt19937(1));
  std::vector<double> times_ms;
  std::pair<double, int64_t> slowest;
  const std::clock_t begin_clock = std::clock();
  for (const int64_t second : seconds) {
    const auto time_ms = show(**reader, **decoder, second);
    if (!time_ms) return fmt::print(stderr, "second {}: {}\n", second, time_ms.error().to_string()), 1;
    times_ms.push_back(*time_ms);
    slowest = std::max(slowest, std::pair(*time_ms, second));
  }
  const double processor_ms = 1e3 * static_cast<double>(std::clock() - begin_clock) / CLOCKS_PER_SEC;
  fmt::print(
      "opened in {:.1f} ms; {} seconds in random order: median {:.1f} ms, slowest {:.1f} ms (second {}); "
      "{:.1f} ms of processor time for one on average\n",
      open_ms, seconds.size(), quantile(times_ms, 0.5), slowest.first, slowest.second,
      processor_ms / static_cast<double>(seconds.size()));
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argument_count, char** arguments) {
  if (argument_count == 2) return strandcast::run(arguments[1]);
  fmt::print(stderr, "usage: scrub_bench RECORDING\n");
  return 2;
}
