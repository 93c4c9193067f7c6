// Which codec a viewer gets, with codecs that are invented: one that predicts and the one behind it.
#include "server/app/viewer_codec.h"
#include "common/base/units.h"

#include "common/scene/scene_fields.h"
#include "common/wire/messages.h"
#include "server/net/strand_class.h"

namespace strandcast::viewer_codec_test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

constexpr size_t kPredicting = 0, kFallback = 1;

std::vector<StrandCodecInfo> predicting_and_plain() {
  return {{"oracle", "", true, "plain", 0.1}, {"plain", ""}};
}

/// Takes 0.04 ms a state and 0.24 % of a core.
ViewerCodecFacts able_viewer() {
  ViewerCodecFacts facts;
  facts.step_ns = 20.0;
  facts.vertices = 2'000;
  facts.states_hz = 60.0;
  return facts;
}

ViewerCodec choice_of(const ViewerCodecFacts& facts) {
  return choose_viewer_codec(predicting_and_plain(), facts);
}

TEST(ViewerCodec, WhoCanAffordItPredicts) {
  const ViewerCodec chosen = choice_of(able_viewer());
  EXPECT_EQ(chosen.codec, kPredicting);
  EXPECT_EQ(chosen.reason, "oracle: 0.0 ms a state on this machine, an estimated 1/10 of plain's bytes");
  ViewerCodecFacts more = able_viewer();
  more.vertices *= 10;
  EXPECT_THAT(choice_of(more).reason, StartsWith("oracle: 0.4 ms a state"));
}

TEST(ViewerCodec, WhoSaysNothingOfItCannotPredictWhateverItWants) {
  for (const char* wish : {"", "oracle", "plain", "something else"}) {
    ViewerCodecFacts facts = able_viewer();
    facts.step_ns = 0.0;
    facts.wish = wish;
    EXPECT_EQ(choice_of(facts).codec, kFallback) << wish;
  }
  ViewerCodecFacts facts = able_viewer();
  facts.step_ns = 0.0;
  EXPECT_THAT(choice_of(facts).reason, StartsWith("plain: this viewer cannot predict"));
}

// Everything that makes a second of prediction dearer does it alike: twice of one and half of another change
// nothing, and beyond the share of a core that it may take the fallback is served.
TEST(ViewerCodec, PredictionMayTakeItsShareOfOneCoreAndNoMore) {
  const auto scaled = [](int which, double factor) {
    ViewerCodecFacts facts = able_viewer();
    facts.step_ns = kPredictionShare * 1e9 / (2'000 * 60.0);  // all of the share
    if (which == 0) facts.step_ns *= factor;
    if (which == 1) facts.vertices = static_cast<size_t>(factor * 2'000.0);
    if (which == 2) facts.states_hz *= factor;
    if (which == 3) facts.substeps *= factor;
    if (which == 4) facts.solver_cost *= factor;
    return facts;
  };
  for (int which = 0; which < 5; ++which) {
    EXPECT_EQ(choice_of(scaled(which, 0.99)).codec, kPredicting) << which;
    const ViewerCodec dear = choice_of(scaled(which, 1.2));
    EXPECT_EQ(dear.codec, kFallback) << which;
    EXPECT_THAT(dear.reason, HasSubstr("60 % of a core; 50 % may be")) << which;
  }
  EXPECT_THAT(choice_of(scaled(0, 1.2)).reason, StartsWith("plain: oracle would take 10.0 ms a state"));
}

TEST(ViewerCodec, AWishCountsWhereItCanBeMet) {
  ViewerCodecFacts facts = able_viewer();
  facts.wish = "plain";
  EXPECT_EQ(choice_of(facts).codec, kFallback);
  EXPECT_EQ(choice_of(facts).reason, "plain: asked for");
  facts.wish = "oracle";
  facts.step_ns = kMaxStepNs;
  EXPECT_EQ(choice_of(facts).codec, kPredicting) << "dear, and that was asked for";
  facts.wish = "morse";
  const ViewerCodec other = choice_of(facts);
  EXPECT_EQ(other.codec, kFallback) << "as without a wish";
  EXPECT_THAT(other.reason, StartsWith("plain: morse was asked for and is not served; oracle would take"));
}

TEST(ViewerCodec, AWideLinkNeedsNoPrediction) {
  ViewerCodecFacts facts = able_viewer();
  facts.fallback_bytes_per_s = 1e6;
  EXPECT_EQ(choice_of(facts).codec, kPredicting) << "a link that is not known counts as thin";
  facts.link_bytes_per_s = 1.01 * kWideLink * 1e6;
  EXPECT_EQ(choice_of(facts).codec, kFallback);
  EXPECT_THAT(choice_of(facts).reason, HasSubstr("the link carries"));
  facts.link_bytes_per_s = 0.99 * kWideLink * 1e6;
  EXPECT_EQ(choice_of(facts).codec, kPredicting);
  facts.link_bytes_per_s = 1e12;
  facts.fallback_bytes_per_s = 0.0;
  EXPECT_EQ(choice_of(facts).codec, kPredicting) << "nobody knows what the other would take";
}

TEST(ViewerCodec, WhereNobodyHasToPredictAllGetTheScenesCodec) {
  for (const auto& served : {std::vector<StrandCodecInfo>{{"plain", ""}},
                             std::vector<StrandCodecInfo>{{"plain", ""}, {"plainer", ""}}}) {
    for (const double step_ns : {0.0, 20.0}) {
      ViewerCodecFacts facts = able_viewer();
      facts.step_ns = step_ns;
      EXPECT_EQ(choose_viewer_codec(served, facts).codec, 0u);
      EXPECT_EQ(choose_viewer_codec(served, facts).reason, "plain: the scene's codec");
    }
  }
  const std::vector<StrandCodecInfo> alone = {{"oracle", "", true, "", 0.1}};
  ViewerCodecFacts facts = able_viewer();
  facts.step_ns = 0.0;
  EXPECT_THAT(choose_viewer_codec(alone, facts).reason, StartsWith("oracle: no other codec is served; this"));
}

TEST(ViewerCodec, ExplainSaysWhoGetsWhich) {
  EXPECT_EQ(
      explain_viewer_codecs(predicting_and_plain()),
      "Viewers of strands get oracle where predicting takes at most 50 % of a core of theirs, else plain; "
      "pictures are drawn from plain.");
  EXPECT_EQ(explain_viewer_codecs({{"plain", ""}}), "Every viewer of strands gets plain.");
  EXPECT_EQ(explain_viewer_codecs({{"plain", ""}, {"plainer", ""}}),
            "Viewers of strands get plain, those who ask for it plainer.");
}

// Whatever a client says, what it is told fits into a Welcome.
TEST(ViewerCodec, ReasonsFitIntoAWelcome) {
  for (const std::string& wish : {std::string(kMaxNameChars, 'x'), std::string("a\nb\x1b[31m")}) {
    for (const double step_ns : {0.0, 1e-300, kMaxStepNs}) {
      ViewerCodecFacts facts = able_viewer();
      facts.wish = wish;
      facts.step_ns = step_ns;
      facts.vertices = 16'000'000;
      const std::string reason = choice_of(facts).reason;
      EXPECT_LE(reason.size(), kMaxTextChars);
      for (const char character : reason) EXPECT_GE(character, ' ') << reason;
    }
  }
}
/// Of a state at 60 Hz.
DecodeLoad load_of(double share) {
  return {share * 1e3 / 60.0, 60.0};
}

/// What a viewer that is looked at four times a second is told, and when.
std::optional<int64_t> told_after(ViewerCodecWatch& watch, const ViewerCodecFacts& facts,
                                  const DecodeLoad& load, int64_t begin_ns) {
  for (int64_t time_ns = begin_ns; time_ns <= begin_ns + 60 * kSInNs; time_ns += kSInNs / 4)
    if (watch.look(predicting_and_plain(), facts, load, time_ns)) return time_ns - begin_ns;
  return std::nullopt;
}

TEST(ViewerCodecWatch, WhoDecodesTooSlowlyForLongGetsTheFallback) {
  ViewerCodecWatch quick(able_viewer(), kPredicting), slow(able_viewer(), kPredicting);
  EXPECT_EQ(told_after(quick, able_viewer(), load_of(0.99 * kSlowDecodeShare), kSInNs), std::nullopt);
  EXPECT_EQ(told_after(slow, able_viewer(), load_of(1.01 * kSlowDecodeShare), kSInNs), kSlowDecodeNs);
  // As it decodes the other one in no time, it stays with that.
  EXPECT_EQ(told_after(slow, able_viewer(), load_of(0.01), 100 * kSInNs), std::nullopt);

  ViewerCodecWatch told(able_viewer(), kPredicting);
  EXPECT_EQ(told.look(predicting_and_plain(), able_viewer(), load_of(0.9), 0), std::nullopt);
  const auto chosen = told.look(predicting_and_plain(), able_viewer(), load_of(0.9), kSlowDecodeNs);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->codec, kFallback);
  EXPECT_EQ(chosen->reason,
            "plain: oracle takes 15.0 ms a state here, 90 % of the time between two; 60 % may be");
}

// One wrong state may be a fault that passes; a second soon after is how this machine computes.
TEST(ViewerCodecWatch, WhoseStatesAreWrongTwiceInARowGetsTheFallback) {
  const auto look = [](ViewerCodecWatch& watch, uint32_t wrong_states, int64_t time_ns) {
    ViewerCodecFacts facts = able_viewer();
    facts.wish = "oracle";
    return watch.look(predicting_and_plain(), facts,
                      {.decode_ms = 1.0, .states_hz = 60.0, .wrong_states = wrong_states}, time_ns);
  };
  ViewerCodecWatch rare(able_viewer(), kPredicting);
  for (uint32_t i = 0; i < 10; ++i) EXPECT_FALSE(look(rare, i, i * (kWrongStatesNs + kSInNs)));

  ViewerCodecWatch wrong(able_viewer(), kPredicting);
  EXPECT_FALSE(look(wrong, 0, 0));
  EXPECT_FALSE(look(wrong, 1, 20 * kSInNs));
  EXPECT_FALSE(look(wrong, 1, 21 * kSInNs)) << "the same one";
  const auto chosen = look(wrong, 2, 20 * kSInNs + kWrongStatesNs - 1);
  ASSERT_TRUE(chosen);
  EXPECT_EQ(chosen->codec, kFallback);
  EXPECT_EQ(chosen->reason, "plain: by oracle this viewer's states are not the server's");
  EXPECT_FALSE(look(wrong, 900, 60 * kSInNs)) << "told once";
}

// A moment is not for long, a viewer of pictures decodes no strands, and rarer states leave more time.
TEST(ViewerCodecWatch, OnlyTimeInARowCounts) {
  ViewerCodecWatch watch(able_viewer(), kPredicting);
  for (int i = 0; i < 20; ++i) {
    const int64_t begin_ns = i * kSlowDecodeNs;
    EXPECT_FALSE(watch.look(predicting_and_plain(), able_viewer(), load_of(2.0), begin_ns));
    EXPECT_FALSE(
        watch.look(predicting_and_plain(), able_viewer(), load_of(2.0), begin_ns + kSlowDecodeNs - 2));
    const DecodeLoad none{load_of(2.0).decode_ms, i % 2 == 0 ? 0.0 : 15.0};
    EXPECT_FALSE(watch.look(predicting_and_plain(), able_viewer(), none, begin_ns + kSlowDecodeNs - 1));
  }
}

TEST(ViewerCodecWatch, OtherStepsAreChosenForAnew) {
  ViewerCodecFacts facts = able_viewer();
  facts.step_ns = 0.5 * kPredictionShare * 1e9 / (2'000 * 60.0);  // half of the share
  const auto look = [&](ViewerCodecWatch& watch) {
    return watch.look(predicting_and_plain(), facts, {}, kSInNs);
  };
  ViewerCodecWatch watch(facts, kPredicting);
  EXPECT_FALSE(look(watch));
  facts.substeps = 4.0;
  const auto dearer = look(watch);
  ASSERT_TRUE(dearer);
  EXPECT_EQ(dearer->codec, kFallback);
  EXPECT_THAT(dearer->reason, HasSubstr("100 % of a core"));
  EXPECT_FALSE(look(watch)) << "told once";
  facts.solver_cost = 0.2;
  const auto cheaper = look(watch);
  ASSERT_TRUE(cheaper);
  EXPECT_EQ(cheaper->codec, kPredicting);
  // Who was too slow for one solver may try with another that costs the same.
  EXPECT_TRUE(told_after(watch, facts, load_of(2.0), 100 * kSInNs));
  facts.solver = "another";
  const auto again = look(watch);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->codec, kPredicting);
}

// As a page does, which asks for its kernels with hair on the screen.
TEST(ViewerCodecWatch, WhoLearnsToPredictIsChosenForAnewOnce) {
  ViewerCodecFacts facts = able_viewer();
  facts.step_ns = 0.0;
  ViewerCodecWatch watch(facts, kFallback);
  EXPECT_EQ(told_after(watch, facts, load_of(0.01), kSInNs), std::nullopt);
  const auto learnt = watch.look(predicting_and_plain(), able_viewer(), load_of(0.01), 100 * kSInNs);
  ASSERT_TRUE(learnt);
  EXPECT_EQ(learnt->codec, kPredicting);
  EXPECT_EQ(told_after(watch, able_viewer(), load_of(2.0), 100 * kSInNs), kSettledDecodeNs + kSlowDecodeNs);
  EXPECT_EQ(told_after(watch, able_viewer(), load_of(0.01), 200 * kSInNs), std::nullopt) << "it was too slow";

  ViewerCodecWatch slow(facts, kFallback);
  facts.step_ns = kPredictionShare * 1e9;
  EXPECT_EQ(told_after(slow, facts, load_of(0.01), kSInNs), std::nullopt)
      << "it learnt that it cannot afford it";
}

// Reports are of the last states, and those may be of what was simulated before.
TEST(ViewerCodecWatch, ReportsOfOtherStepsDoNotCount) {
  ViewerCodecFacts facts = able_viewer();
  ViewerCodecWatch watch(facts, kPredicting);
  facts.solver = "another";
  EXPECT_FALSE(watch.look(predicting_and_plain(), facts, load_of(2.0), kSInNs));
  EXPECT_EQ(told_after(watch, facts, load_of(2.0), kSInNs), kSettledDecodeNs + kSlowDecodeNs);
}

TEST(ViewerCodecWatch, WhoAskedForACodecKeepsIt) {
  ViewerCodecFacts facts = able_viewer();
  for (const auto& [wish, codec] : {std::pair{"oracle", kPredicting}, {"plain", kFallback}}) {
    facts.wish = wish;
    ViewerCodecWatch watch(facts, codec);
    EXPECT_EQ(told_after(watch, facts, load_of(5.0), kSInNs), std::nullopt) << wish;
    facts.substeps *= 1e6;
    EXPECT_EQ(told_after(watch, facts, load_of(5.0), 100 * kSInNs), std::nullopt) << wish;
  }
}

TEST(ViewerCodecWatch, WhereNothingElseIsServedNothingChanges) {
  const std::vector<StrandCodecInfo> alone = {{"oracle", "", true, "", 0.1}};
  ViewerCodecFacts facts = able_viewer();
  ViewerCodecWatch watch(facts, 0);
  for (int64_t time_ns = 0; time_ns < 60 * kSInNs; time_ns += kSInNs) {
    if (time_ns == 30 * kSInNs) facts.substeps = 1e6;
    EXPECT_FALSE(watch.look(alone, facts, load_of(5.0), time_ns));
  }
}

TEST(ServedCodecs, ASecondOneTakesTheSameStates) {
  const auto served = [](const std::string& codec, const std::string& fallback) {
    StrandCodecInfo info = strand_codec_info(codec).value();
    info.fallback = fallback;
    std::vector<std::string> names;
    const auto found = served_codecs(info, 1e-4f);
    EXPECT_TRUE(found.ok());
    for (size_t i = 0; found.ok() && i < found->size(); ++i) names.push_back((*found)[i].name);
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(served("delta", "raw"), (Names{"delta", "raw"}));
  EXPECT_EQ(served("delta", "tangent"), Names{"delta"})
      << "states on a finer lattice would have to be published";
  EXPECT_EQ(served("delta", ""), Names{"delta"});
  EXPECT_EQ(served("delta", "delta"), Names{"delta"});
  StrandCodecInfo lost = strand_codec_info("delta").value();
  lost.fallback = "no such codec";
  EXPECT_EQ(served_codecs(lost, 1e-4f).error().code, ErrorCode::NotFound);
}

// A codec that not every viewer can decode has one behind it that every viewer can.
TEST(ServedCodecs, WhatPredictsHasAFallbackThatDoesNot) {
  for (const StrandCodecInfo& codec : strand_codecs()) {
    for (const float bound_m : {1e-6f, 2e-5f, 1e-4f, 3e-4f, 5e-4f}) {
      const auto served = served_codecs(codec, bound_m);
      ASSERT_TRUE(served.ok()) << codec.name;
      EXPECT_FALSE(served->back().predicts) << codec.name;
      EXPECT_EQ(served->size(), codec.fallback.empty() ? 1u : 2u) << codec.name << " " << bound_m;
    }
    EXPECT_GT(codec.bytes_share, 0.0) << codec.name;
    EXPECT_LE(codec.bytes_share, 1.0) << codec.name;
  }
}

}  // namespace
}  // namespace strandcast::viewer_codec_test
