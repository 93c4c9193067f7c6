#include "common/gl/pass_list.h"

namespace strandcast::gl::pass_list_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct ToySetup {
  std::vector<std::string>& prepared;
};

struct ToyTurn : PassTurn {
  using Setup = ToySetup;
  std::vector<std::string> ran;
  std::string fails;  // the name of a pass
  uint32_t batches = 1;
};

class ToyPass final : public Pass<ToyTurn> {
 public:
  ToyPass(PassDeclaration declaration, uint64_t own_bytes, bool is_batched = false)
      : Pass(std::move(declaration), PassClock::Host), own_bytes_(own_bytes), is_batched_(is_batched) {}
  uint64_t size_bytes() const override { return own_bytes_; }
  bool is_batched() const override { return is_batched_; }
  Status prepare(const ToySetup& setup) override {
    setup.prepared.push_back(declaration().name);
    return {};
  }
  Status run(ToyTurn& turn) override {
    turn.ran.push_back(is_batched_ ? fmt::format("{} {}", declaration().name, turn.batch_index)
                                   : declaration().name);
    if (is_batched_) turn.has_more_batches = turn.batch_index + 1 < turn.batches;
    if (turn.fails == declaration().name) return make_error(ErrorCode::LimitExceeded, "too much");
    return {};
  }

 private:
  uint64_t own_bytes_;
  bool is_batched_;
};

/// keys -> expand -> segments -> strands -> scene -> resolve -> picture, a head that may be off, and a shadow
/// that only the glow reads.
class PassListTest : public testing::Test {
 protected:
  void fill(bool has_head) {
    const auto add = [this](PassDeclaration declaration, uint64_t bytes, bool is_batched) {
      list_.add(std::make_unique<ToyPass>(std::move(declaration), bytes, is_batched));
    };
    add({"shadow", {&keys_}, {&shadow_}, true, ""}, 7, false);
    add({"head", {}, {&scene_}, has_head, "no head"}, 50, false);
    add({"expand", {&keys_}, {&segments_}, true, ""}, 1, true);
    add({"strands", {&segments_}, {&scene_}, true, ""}, 2, true);
    add({"resolve", {&scene_}, {&picture_}, true, ""}, 3, false);
    add({"glow", {&shadow_}, {&glow_}, true, ""}, 0, false);
  }
  std::vector<std::string> kept_in_report() const {
    std::vector<std::string> names;
    for (const PassReport& pass : list_.report())
      if (pass.fate == PassFate::Kept) names.push_back(pass.name);
    return names;
  }

  Resource keys_{"keys", 1'000'000};  // from outside
  Resource segments_{"segments", 100};
  Resource scene_{"scene", 1000};
  Resource picture_{"picture", 10};
  Resource shadow_{"shadow map", 10'000};
  Resource glow_{"glow map", 100'000};
  PassList<ToyTurn> list_;
  std::vector<std::string> prepared_;
};

TEST_F(PassListTest, WhatIsPrintedIsWhatIsPreparedAndRun) {
  fill(true);
  EXPECT_THAT(list_.report(), IsEmpty()) << "nothing is decided yet";
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  ASSERT_TRUE(list_.prepare({prepared_}));
  ToyTurn turn;
  ASSERT_TRUE(list_.run(turn, nullptr));
  EXPECT_THAT(kept_in_report(), ElementsAre("head", "expand", "strands", "resolve"));
  EXPECT_THAT(turn.ran, ElementsAre("head", "expand 0", "strands 0", "resolve"));
  EXPECT_EQ(prepared_, kept_in_report());
  for (const PassReport& pass : list_.report()) {
    EXPECT_EQ(pass.runs, pass.fate == PassFate::Kept ? 1u : 0u) << pass.name;
    EXPECT_FALSE(pass.reason.empty()) << pass.name;
  }
}

TEST_F(PassListTest, WhatIsOffIsPrintedWithItsFactAndNeverPrepared) {
  fill(false);
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  ASSERT_TRUE(list_.prepare({prepared_}));
  ToyTurn turn;
  ASSERT_TRUE(list_.run(turn, nullptr));
  EXPECT_THAT(turn.ran, ElementsAre("expand 0", "strands 0", "resolve"));
  EXPECT_THAT(prepared_, ElementsAre("expand", "strands", "resolve"));
  EXPECT_EQ(list_.report()[1].fate, PassFate::NotRequested);
  EXPECT_EQ(list_.report()[1].reason, "no head");
}

TEST_F(PassListTest, PassesOfABatchRunTogetherUntilTheFrameHasNoMore) {
  fill(false);
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  ToyTurn turn;
  turn.batches = 3;
  ASSERT_TRUE(list_.run(turn, nullptr));
  EXPECT_THAT(turn.ran, ElementsAre("expand 0", "strands 0", "expand 1", "strands 1", "expand 2", "strands 2",
                                    "resolve"));
  EXPECT_EQ(list_.report()[2].runs, 1u) << "batches are one run";
}

TEST_F(PassListTest, ANewWishPreparesOnlyWhatIsNew) {
  fill(true);
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  ASSERT_TRUE(list_.prepare({prepared_}));
  prepared_.clear();
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_, &glow_}));
  ASSERT_TRUE(list_.prepare({prepared_}));
  EXPECT_THAT(prepared_, ElementsAre("shadow", "glow"));
  prepared_.clear();
  ASSERT_TRUE(list_.plan({&keys_}, {}));
  ASSERT_TRUE(list_.prepare({prepared_}));
  ToyTurn turn;
  ASSERT_TRUE(list_.run(turn, nullptr));
  EXPECT_THAT(prepared_, IsEmpty());
  EXPECT_THAT(turn.ran, IsEmpty());
  EXPECT_EQ(list_.live_bytes(), 0u);
}

TEST_F(PassListTest, BytesAreThoseOfLiveResourcesAndOfRunningPasses) {
  fill(false);
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  EXPECT_EQ(list_.live_bytes(), 100u + 1000u + 10u + (1u + 2u + 3u));
  EXPECT_EQ(list_.saved_bytes(), 10'000u + 100'000u + (7u + 50u + 0u));
  uint64_t printed = 0;
  for (const PassReport& pass : list_.report()) printed += pass.size_bytes;
  EXPECT_EQ(printed, list_.live_bytes() + list_.saved_bytes()) << "each resource is counted once";
}

TEST_F(PassListTest, TheFirstErrorEndsTheRunAndLeavesNoTime) {
  fill(true);
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  ToyTurn turn;
  turn.fails = "expand";
  const Status status = list_.run(turn, nullptr);
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::LimitExceeded);
  EXPECT_THAT(turn.ran, ElementsAre("head", "expand 0"));
  EXPECT_EQ(list_.report()[1].runs, 0u) << "half a picture says nothing about how long one takes";
}

TEST_F(PassListTest, AnImpossibleWishLeavesTheOldDecision) {
  fill(true);
  ASSERT_TRUE(list_.plan({&keys_}, {&picture_}));
  EXPECT_FALSE(list_.plan({}, {&picture_})) << "nobody writes the keys";
  EXPECT_THAT(kept_in_report(), ElementsAre("head", "expand", "strands", "resolve"));
}

}  // namespace
}  // namespace strandcast::gl::pass_list_test
