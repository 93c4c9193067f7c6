#include <unistd.h>

#include <filesystem>
#include <numeric>

#include "common/base/file.h"
#include "common/base/hash.h"
#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/base/result.h"

namespace strandcast::base_test {
namespace {

Result<int> half(int value) {
  if (value % 2 != 0) return make_error(ErrorCode::BadInput, "{} is odd", value);
  return value / 2;
}

Result<int> quarter(int value) {
  ASSIGN_OR_RETURN(const int first, half(value));
  return half(first);
}

TEST(Result, PassesValuesAndErrorsThrough) {
  EXPECT_EQ(*quarter(12), 3);
  const auto failed = quarter(6);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "3 is odd");
  EXPECT_EQ(at("file.txt", failed.error()).to_string(), "file.txt: 3 is odd");
  EXPECT_EQ(at("a", at("b", failed.error())).place, "a, b");
}

TEST(File, RefusesMissingOversizedAndSpecialFiles) {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("strandcast_file_{}", getpid());
  std::filesystem::create_directories(folder);
  const auto path = folder / "five.bin";
  const std::vector<std::byte> bytes(5, std::byte{7});
  ASSERT_TRUE(save_file(path, bytes));
  EXPECT_EQ(*load_file(path, 5), bytes);
  EXPECT_EQ(load_file(path, 4).error().code, ErrorCode::LimitExceeded);
  EXPECT_EQ(load_file(folder / "none", 10).error().code, ErrorCode::NotFound);
  EXPECT_EQ(load_file(folder, 10).error().code, ErrorCode::BadInput);
  EXPECT_EQ(load_file("/dev/zero", 10).error().code, ErrorCode::BadInput);
  EXPECT_FALSE(save_file(folder / "no_such_folder" / "x", bytes));
  std::filesystem::remove_all(folder);
}

TEST(Hash, ChangesWithEveryByteAndChains) {
  std::vector<std::byte> bytes(37);
  const uint64_t original = hash_bytes(bytes);
  for (size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = std::byte{1};
    EXPECT_NE(hash_bytes(bytes), original) << "byte " << i;
    bytes[i] = std::byte{0};
  }
  EXPECT_NE(hash_bytes(bytes, original), original);
}

TEST(Hash, MixSpreadsNeighbouringIntegers) {
  double sum = 0.0;
  constexpr int kSamples = 10'000;
  for (uint32_t i = 0; i < kSamples; ++i) sum += unit_float(mix_u32(i));
  // Mean of uniform numbers: 1/2 with standard deviation sqrt(1/12/n) = 0.0029; four of them.
  EXPECT_NEAR(sum / kSamples, 0.5, 4 * 0.0029);
}

TEST(StageTimer, GivesQuantilesOfTheWindow) {
  StageTimer timer;
  EXPECT_EQ(timer.median_ms(), 0.0);
  for (int i = 1; i <= 101; ++i) timer.add_ms(i);
  EXPECT_EQ(timer.median_ms(), 51.0);
  EXPECT_EQ(timer.quantile_ms(1.0), 101.0);
  for (int i = 0; i < kStageWindow; ++i) timer.add_ms(5.0);
  EXPECT_EQ(timer.quantile_ms(1.0), 5.0);
}

TEST(Quantile, IsTheValueOfTheNearestRank) {
  EXPECT_EQ(median(std::vector<double>{}), 0.0);
  EXPECT_EQ(median(std::vector<double>{7.0}), 7.0);
  EXPECT_EQ(median(std::vector<int>{5, 1, 3}), 3);
  EXPECT_EQ(median(std::vector<int>{4, 1, 3, 2}), 3) << "the upper of the two in the middle";
  std::vector<int> hundred_and_one(101);
  std::iota(hundred_and_one.rbegin(), hundred_and_one.rend(), 0);
  for (const int percent : {0, 1, 50, 99, 100})
    EXPECT_EQ(quantile(hundred_and_one, percent / 100.0), percent);
}

}  // namespace
}  // namespace strandcast::base_test
