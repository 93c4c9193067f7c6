// strandcast-vopr: runs the whole system on simulated time, by a seed or many, each in a process of its own.
#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <sched.h>
#include <sys/personality.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/version.h"
#include "common/pictures/picture.h"
#include "common/wire/messages.h"
#include "server/scene/scene_content.h"
#include "tests/vopr/links.h"
#include "tests/vopr/system.h"
#include "tests/vopr/threads_private.h"

namespace strandcast::vopr {
namespace {

constexpr const char* kUsage =
    "usage: strandcast-vopr [--seed N | --seeds A..B] [--simulate SECONDS] [--plant NAME] [--calm] [--show]\n"
    "       strandcast-vopr --links corners|whole\n"
    "  --seed N          one run (1)\n"
    "  --seeds A..B      many runs, one after the other; ends with 1 if any of them breaks a rule\n"
    "  --simulate S      simulated seconds of each run (60)\n"
    "  --plant NAME      plants a fault that the rules must find:\n"
    "                    wrong-hash, stays-away, done-twice, token-in-log, deaf, relay-ends,\n"
    "                    first-is-final, feeder-ends, one-queue, long-command, report-forgets, lost-bytes\n"
    "  --calm            no faults\n"
    "  --show            prints every line as it comes\n"
    "  --links GRID      one viewer at links of every rate, delay and share of stalls: ends with 1 where one "
    "finds\n"
    "                    no class that fits, does not keep it, or has its first picture or exact frame "
    "late\n";

struct Options {
  uint64_t first = 1, last = 1;
  RunPlan plan;
  bool is_help = false;
  std::optional<LinkGrid> links;
};

std::optional<Plant> plant_of(const std::string& name) {
  static const std::map<std::string, Plant> plants = {{"wrong-hash", Plant::WrongHash},
                                                      {"stays-away", Plant::StaysAway},
                                                      {"done-twice", Plant::DoneTwice},
                                                      {"token-in-log", Plant::TokenInLog},
                                                      {"deaf", Plant::Deaf},
                                                      {"relay-ends", Plant::RelayEnds},
                                                      {"first-is-final", Plant::FirstIsFinal},
                                                      {"feeder-ends", Plant::FeederEnds},
                                                      {"one-queue", Plant::OneQueue},
                                                      {"long-command", Plant::LongCommand},
                                                      {"report-forgets", Plant::ReportForgets},
                                                      {"lost-bytes", Plant::LostBytes}};
  const auto found = plants.find(name);
  return found == plants.end() ? std::nullopt : std::optional(found->second);
}

/// Empty when something is wrong with them.
std::optional<Options> parse(int count, char** words) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    const char* const value = i + 1 < count ? words[i + 1] : nullptr;
    char* end = nullptr;
    if (word == "--help") {
      options.is_help = true;
    } else if (word == "--calm") {
      options.plan.has_faults = false;
    } else if (word == "--show") {
      options.plan.is_shown = true;
    } else if (value == nullptr) {
      return std::nullopt;
    } else if (word == "--seed") {
      options.first = options.last = std::strtoull(value, &end, 10);
    } else if (word == "--seeds") {
      options.first = std::strtoull(value, &end, 10);
      if (std::strncmp(end, "..", 2) != 0) return std::nullopt;
      options.last = std::strtoull(end + 2, &end, 10);
    } else if (word == "--links") {
      if (std::strcmp(value, "whole") != 0 && std::strcmp(value, "corners") != 0) return std::nullopt;
      options.links = *value == 'w' ? LinkGrid::Whole : LinkGrid::Corners;
    } else if (word == "--simulate") {
      options.plan.simulated_s = std::strtod(value, &end);
    } else if (word == "--plant") {
      const auto plant = plant_of(value);
      if (!plant) return std::nullopt;
      options.plan.plant = *plant;
    } else {
      return std::nullopt;
    }
    if (end != nullptr && (*end != 0 || end == value)) return std::nullopt;
    if (word.starts_with("--seed") || word == "--simulate" || word == "--plant" || word == "--links") ++i;
  }
  return options;
}

/// Addresses and the processor are the same in every run; the first decide in which order some sets are
/// walked.
void hold_still(char** words) {
  const int persona = personality(0xffffffff);
  if ((persona & ADDR_NO_RANDOMIZE) == 0) {
    if (personality(persona | ADDR_NO_RANDOMIZE) != -1) execv("/proc/self/exe", words);
    std::fputs("addresses differ from run to run here, so a seed may be another run\n", stderr);
  }
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  sched_setaffinity(0, sizeof(one), &one);
}

/// What all runs need alike, in the process that they are copies of. One heap, which keeps what it has.
void warm_up() {
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TOP_PAD, 16 << 20);
  (void)decodable_picture_codecs();                 // loads libraries
  (void)load_scene_content(scene_of_run("delta"));  // and these tables of protobuf
  (void)decode_client_message(encode(ClientMessage(Hello{})));
}

double processor_s() {
  static const auto clock = world::real<int (*)(clockid_t, timespec*)>("clock_gettime");
  timespec time{};
  clock(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

[[noreturn]] void run_one(const RunPlan& plan) {
  const double begin_s = processor_s();
  const RunResult result = run_system(plan);
  const double took_s = processor_s() - begin_s;
  fmt::print(
      "seed {}: digest {:016x}, {:.0f} simulated s in {:.2f} processor s ({:.0f} times), {} states compared, "
      "{} changes "
      "answered, {} recorded states recovered, {} faults, back after {} ms (median) to {} ms, {:.0f} % "
      "within 2 s, {} turns\n",
      plan.seed, result.digest, result.simulated_s, took_s, result.simulated_s / took_s,
      result.compared_states, result.answered_changes, result.recorded_states, result.faults,
      result.back_median_ms, result.back_longest_ms, result.back_share_2s * 100.0, result.switches);
  std::fflush(stdout);
  _exit(0);
}

int run_many(const Options& options) {
  uint64_t failed = 0;
  for (uint64_t seed = options.first; seed <= options.last; ++seed) {
    RunPlan plan = options.plan;
    plan.seed = seed;
    plan.folder =
        std::filesystem::temp_directory_path() / fmt::format("strandcast-vopr-{}-{}", getpid(), seed);
    std::filesystem::create_directory(plan.folder);
    std::fflush(stdout);
    const pid_t child = fork();
    if (child == 0) {
      std::filesystem::current_path(plan.folder);  // no line of the log has its name
      plan.folder.clear();
      run_one(plan);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) return 2;
    std::filesystem::remove_all(plan.folder);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) continue;
    ++failed;
    if (WIFSIGNALED(status)) fmt::print("seed {}: ended by signal {}\n", seed, WTERMSIG(status));
    fmt::print("seed {} failed; again: strandcast-vopr --seed {} (version {})\n", seed, seed, version());
  }
  fmt::print("{} seeds, {} failed\n", options.last - options.first + 1, failed);
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace strandcast::vopr

int main(int count, char** words) {
  using namespace strandcast::vopr;
  const auto options = parse(count, words);
  if (!options) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  if (options->is_help) {
    std::fputs(kUsage, stdout);
    return 0;
  }
  hold_still(words);
  warm_up();
  if (options->links) return walk_links(*options->links) == 0 ? 0 : 1;
  return run_many(*options);
}
