// Every committed input of every fuzzer, with any compiler. An entry stops the process where it finds
// something wrong, and the sanitizers where they do; the file is named first.
#include <algorithm>
#include <array>
#include <filesystem>

#include "common/base/file.h"
#include "tests/fuzz/fuzz_targets.h"
#include "tests/support/bounded_work.h"

namespace strandcast::corpus_test {
namespace {

struct Target {
  std::string name;
  int (*entry)(const uint8_t*, size_t);
};

const std::vector<Target> kTargets = {
#define FUZZ_TARGET(name) {#name, fuzz_##name},
#include "fuzz_targets.inc"
#undef FUZZ_TARGET
};

std::filesystem::path corpus() {
  return std::filesystem::path(STRANDCAST_SOURCE_DIR) / "tests/fuzz/corpus";
}

/// Whether it reads files that people bring: none may cost much. Their code is of one thread.
bool is_of_files(const std::string& name) {
  constexpr std::array kNames = {"abc", "bvh",      "hair", "obj",  "ply",
                                 "tfx", "tfx_text", "usda", "usdc", "wind_csv"};
  return std::find(kNames.begin(), kNames.end(), name) != kNames.end();
}

class FuzzCorpus : public testing::TestWithParam<Target> {};

TEST_P(FuzzCorpus, RunsThroughItsTarget) {
  constexpr uint64_t kMaxInputBytes = 1 << 20;
  const Target& target = GetParam();
  EXPECT_EQ(target.entry(nullptr, 0), 0);
  int file_count = 0;
  for (const auto& file : std::filesystem::directory_iterator(corpus() / target.name)) {
    fmt::print("{}\n", file.path().filename().string());
    std::fflush(stdout);
    const auto bytes = load_file(file.path(), kMaxInputBytes);
    ASSERT_TRUE(bytes) << bytes.error().to_string();
    const auto run = [&] {
      return target.entry(reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size());
    };
    EXPECT_EQ(run(), 0);
    if (is_of_files(target.name)) {
      EXPECT_EQ(test::beyond_bounds(run), "");
    }
    ++file_count;
  }
  EXPECT_GT(file_count, 0) << "no inputs in " << corpus() / target.name;
}

INSTANTIATE_TEST_SUITE_P(Corpus, FuzzCorpus, testing::ValuesIn(kTargets),
                         [](const auto& target) { return target.param.name; });

TEST(FuzzCorpusFolder, HoldsOneSmallFolderForEachTarget) {
  constexpr uint64_t kMaxCorpusBytes = 400'000;
  uint64_t corpus_bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(corpus())) {
    if (entry.is_regular_file()) {
      corpus_bytes += entry.file_size();
      continue;
    }
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(std::any_of(kTargets.begin(), kTargets.end(),
                            [&](const Target& target) { return target.name == name; }))
        << "no target is called " << name;
  }
  EXPECT_LT(corpus_bytes, kMaxCorpusBytes);
}

}  // namespace
}  // namespace strandcast::corpus_test
