// Which codec a viewer gets, with codecs that are invented: one that predicts and the one behind it.
#include "server/app/viewer_codec.h"

#include "common/scene/scene_fields.h"
#include "common/wire/messages.h"
#include "server/net/strand_class.h"

namespace strandcast {
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
    for (const float bound_m : {2e-5f, 1e-4f, 3e-4f, 5e-4f}) {
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
}  // namespace strandcast
