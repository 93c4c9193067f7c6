// The numbers in the documents are those that tests hold (tests/support/claims.h) or that the code has, and
// docs/internals/figures.md has no other measured number. README.md has none at all.
#include "tests/support/claims.h"
#include "common/base/mercy.h"
#include "common/base/units.h"

#include <regex>

#include "common/base/file.h"
#include "common/scene/scene_fields.h"
#include "server/app/mode_policy.h"
#include "server/encode/frame_worker.h"
#include "server/encode/picture_encoder.h"
#include "server/net/class_choice.h"
#include "server/net/send_gate.h"
#include "server/report/streaming.h"
#include "server/report/work_precision.h"
#include "server/source/simulation_source.h"

namespace strandcast::claims_test {
namespace {

std::string text_of(const std::string& document) {
  return load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / document, 1u << 20).value();
}

std::string on_one_line(const std::string& text) {
  return std::regex_replace(text, std::regex("\\s+"), " ");
}

std::string percent(double share) {
  return fmt::format("{:g} %", 100.0 * share);
}

std::vector<std::string> measured_claims() {
  using namespace claims;
  return {
      fmt::format("({} vertices, one linear solve per step)", kRodVertices),
      fmt::format("tip of a cantilever within {} of its length up to Gamma {:g}", percent(kCantileverTip),
                  kCantileverGamma),
      fmt::format("within {} up to {:g}", percent(kHeavyCantileverTip), kHeavyCantileverGamma),
      fmt::format("the tip under an end load within {}", percent(kEndLoadTip)),
      fmt::format("first swing within {} at {:g} Hz", percent(kFirstSwing), kFirstSwingHz),
      fmt::format("curls as helical springs within {}", percent(kCurlSpring)),
      fmt::format("buckling load bracketed within {}", percent(kBuckling)),
      fmt::format("stand within {:g} degrees of their groomed direction", kFollicleLimitDeg),
      fmt::format("stretch below {} in a head shake of {:g} g", percent(kShakeStretch), kShakeG),
      fmt::format("by up to {:.0f} % (`pbd`) and {:.0f} % (`xpbd`)", 100.0 * kPbdViolentStretch,
                  100.0 * kXpbdViolentStretch),
      fmt::format(
          "`tangent` at {:g} mm takes {:g} bits per vertex when idle, {:g} turning and {:g} in violent "
          "motion",
          1e3 * kGoalBoundM, kIdleBits, kActiveBits, kViolentBits),
      fmt::format("{} x {}, `dftl`;", kStreamStrands, kStreamVertices),
      fmt::format("the asset: at most {} kB for 2000 x 16 with the head", kAssetKb),
      fmt::format("{:g} in the median half second of a walk ({})", kClipBits, kStreamClip),
      fmt::format("{:g} times fewer than the best of the others with a prediction in time around it",
                  kTimesFewerThanTemporal),
      fmt::format("{:g} times fewer than the best on plain positions", kTimesFewerThanPlain),
      fmt::format("takes {:g} bits per vertex at {:g} mm when idle, {:g} turning and {:g} in violent motion",
                  kStepIdleBits, 1e3 * kGoalBoundM, kStepActiveBits, kStepViolentBits),
      fmt::format("{} x {}, `dftl`, all of the wind known", kStepStrands, kStreamVertices),
      fmt::format(
          "{:g} in the median half second of a walk ({}): {:g} times fewer than the best of the others "
          "with a prediction in time around it.",
          kStepClipBits, kStreamClip, kStepTimesFewerThanTemporal),
      fmt::format("`step` takes {:g} bits per vertex when idle, {:g} turning and {:g} in violent motion, and "
                  "`tangent` "
                  "{:g}, {:g} and {:g} bits",
                  kFullStepBits[0], kFullStepBits[1], kFullStepBits[2], kFullTangentBits[0],
                  kFullTangentBits[1], kFullTangentBits[2]),
      fmt::format("32-bit floats take {}", 3 * 32),
      fmt::format("{} vertices, steps of 1/{:g} s", WorkGrid().reference_vertices,
                  WorkGrid().reference_rate_hz),
      fmt::format("from `{}`, another model, by at most {} of the length", kCheckModel,
                  percent(kModelsApart)),
      fmt::format("at {:g}, {:g}, {:g}, {:g} and {:g} mm", 1e3 * kStreamBoundsM[0], 1e3 * kStreamBoundsM[1],
                  1e3 * kStreamBoundsM[2], 1e3 * kStreamBoundsM[3], 1e3 * kStreamBoundsM[4]),
      fmt::format("from {:g} m and {:g} m at each bound", kViewDistancesM[0], kViewDistancesM[1]),
      fmt::format("stream.bound_m={:g}", 2e-4),
      fmt::format("{:.6f}..{:.4f}", scene_fields::kStreamBound.minimum, scene_fields::kStreamBound.maximum),
      fmt::format("Viewers hear of it within {:g} s", kLookChangeNs / kNsPerS),
      fmt::format("states per second, {:g}..{:.0f},000, at most", scene_fields::kStrandRate.minimum,
                  scene_fields::kStrandRate.maximum / 1000.0),
  };
}

std::vector<std::string> built_claims() {
  using namespace claims;
  return {
      fmt::format("({:g} mm unless the scene says otherwise)", 1e3 * StreamDesc().bound_m),
      fmt::format("{:g} to {:g} times the bits", kLeastDeltaRatio, kMostDeltaRatio),
      fmt::format("a quarter of {} strands of the built-in scene", kFilledStrands),
      fmt::format("within {:g} mm of the truth (median; {:g} mm for 95 %)", kFilledMedianMm, kFilledMostMm),
      fmt::format("At most {} ms of frames wait (a keyframe: {};", kGateQueueNs / kMsInNs,
                  kStartDelayNs / kMsInNs),
      fmt::format("only the asset, or {} KiB", kFirstBytes >> 10),
      fmt::format("at most every {} ms and the newest only", kLookChangeNs / kMsInNs),
      fmt::format("at most one in {:g} s for all", kKeyframePauseNs / kNsPerS),
      fmt::format("after {} periods it comes once more", kStillPeriods),
      fmt::format("frame {} in {:g} s found no place", kTroublingLosses, kLossWindowNs / kNsPerS),
      fmt::format("worth {:g} times as much as strands, for {:g} s", kFramesGain, kWishNs / kNsPerS),
      fmt::format("({:g} times while the time of a server without a GPU is only guessed)",
                  kGuessedFramesGain),
      fmt::format("within {:g} mm of what was simulated", 1e3 * scene_fields::kStreamBound.minimum),
      fmt::format("more than a {} refuses it", kMostBadShare == 10 ? "tenth" : "share"),
      fmt::format("no change follows another within {:g} s", kFirstDwellNs / kNsPerS),
  };
}

/// README.md, ARCHITECTURE.md and the pages under docs, in one text.
std::string documents() {
  std::string text = text_of("README.md") + text_of("ARCHITECTURE.md");
  const std::filesystem::path root = STRANDCAST_SOURCE_DIR;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md")
      text += text_of(std::filesystem::relative(entry.path(), root).string());
  return on_one_line(text);
}

TEST(Claims, StandInDocuments) {
  const std::string text = documents();
  for (const std::string& claim : measured_claims()) EXPECT_NE(text.find(claim), std::string::npos) << claim;
  for (const std::string& claim : built_claims()) EXPECT_NE(text.find(claim), std::string::npos) << claim;
}

/// Numbers with a unit of something measured, outside of commands.
std::vector<std::string> measured_numbers(std::string text) {
  text = on_one_line(std::regex_replace(text, std::regex("\n    [^\n]*"), "\n"));
  text = std::regex_replace(text, std::regex("`[^`]*`"), "");
  const std::regex number(
      "[0-9][0-9.,]*(e-[0-9]+)? ?"
      "(%|(times|bits|(M|k)?bit/s|m?s|mm|dB|kB|MiB|micro\\w+|milli\\w+|seconds?|minutes?)\\b)");
  std::vector<std::string> found;
  for (auto match = std::sregex_iterator(text.begin(), text.end(), number); match != std::sregex_iterator();
       ++match)
    found.push_back(match->str());
  return found;
}

TEST(Claims, NumbersAreSeenOutsideOfCommands) {
  EXPECT_THAT(
      measured_numbers("takes 2.4 to 2.6 bits,\n    sleep 3 s\n`7 ms`, 1,000 times as `x` 5 % more\n"),
      testing::ElementsAre("2.6 bits", "1,000 times", "5 %"));
  EXPECT_THAT(measured_numbers("0.3 microseconds and 3.8 ms"),
              testing::ElementsAre("0.3 microseconds", "3.8 ms"));
}

TEST(Claims, AreAllThatFiguresMeasure) {
  const std::string text = text_of("docs/internals/figures.md");
  const size_t end = text.find("## Where other numbers are held");
  ASSERT_NE(end, std::string::npos);
  std::string rest = on_one_line(text.substr(0, end));
  EXPECT_THAT(measured_numbers(rest), testing::Not(testing::IsEmpty()));
  for (const std::string& claim : measured_claims())
    for (size_t at = rest.find(claim); at != std::string::npos; at = rest.find(claim))
      rest.erase(at, claim.size());
  EXPECT_THAT(measured_numbers(rest), testing::IsEmpty())
      << "put them into tests/support/claims.h with a test";
}

TEST(Claims, ReadmeMeasuresNothing) {
  EXPECT_THAT(measured_numbers(text_of("README.md")), testing::IsEmpty())
      << "docs/internals/figures.md is the place for them";
}

}  // namespace
}  // namespace strandcast::claims_test
