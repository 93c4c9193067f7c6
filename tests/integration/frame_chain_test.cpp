// Laws of the chain that a relay keeps for those who join: it can always be decoded, and it is bounded.
#include "server/relay/frame_chain.h"

#include <gtest/gtest.h>

namespace strandcast::frame_chain_test {
namespace {

EncodedFramePtr frame(Opcode opcode, uint32_t sequence, uint32_t base, size_t bytes = 100) {
  auto made = std::make_shared<EncodedFrame>();
  made->header.opcode = opcode;
  made->header.sequence = sequence;
  made->header.base_sequence = base;
  made->message.resize(bytes);
  return made;
}
EncodedFramePtr keyframe(uint32_t sequence) {
  return frame(Opcode::StrandKeyframe, sequence, 0);
}
EncodedFramePtr delta(uint32_t sequence, size_t bytes = 100) {
  return frame(Opcode::StrandDelta, sequence, sequence - 1, bytes);
}

TEST(FrameChain, BeginsWithAKeyframeAndGoesOnWithWhatFollows) {
  FrameChain chain;
  chain.add(delta(3), 1);
  EXPECT_TRUE(chain.frames().empty());
  EXPECT_FALSE(chain.serves_joiners());
  chain.add(keyframe(3), 2);
  chain.add(delta(4), 3);
  chain.add(delta(5), 4);
  ASSERT_EQ(chain.frames().size(), 3u);
  EXPECT_EQ(chain.frames().back()->header.sequence, 5u);
  EXPECT_TRUE(chain.serves_joiners());
  chain.add(keyframe(5), 5);
  EXPECT_EQ(chain.frames().size(), 1u) << "a fresh one takes the place of all before";
}

TEST(FrameChain, EndsWhereADeltaIsMissing) {
  FrameChain chain;
  chain.add(keyframe(1), 1);
  chain.add(delta(3), 2);
  EXPECT_TRUE(chain.frames().empty());
  EXPECT_FALSE(chain.serves_joiners());
}

TEST(FrameChain, ServesNoJoinerOnceAKeyframeCostsNoMoreThanItsDeltas) {
  FrameChain chain;
  chain.add(keyframe(1), 0);
  chain.add(delta(2, 60), kChainNs - 1);
  chain.add(delta(3, 30), kChainNs);
  EXPECT_TRUE(chain.serves_joiners()) << "90 bytes of deltas, 100 of the keyframe";
  chain.add(delta(4, 10), kChainNs + 1);
  EXPECT_FALSE(chain.serves_joiners());
  chain.add(keyframe(4), kChainNs + 2);
  chain.add(delta(5, 1'000), 2 * kChainNs);
  EXPECT_TRUE(chain.serves_joiners()) << "not sooner, whatever it takes";
}

TEST(FrameChain, ServesNoJoinerAfterAWhileAndIsGivenUpThen) {
  FrameChain chain;
  chain.add(keyframe(1), 0);
  chain.add(delta(2, 1), kLongestChainNs - 1);
  EXPECT_TRUE(chain.serves_joiners());
  chain.add(delta(3, 1), kLongestChainNs);
  EXPECT_FALSE(chain.serves_joiners());
  for (uint32_t sequence = 4; sequence < 2 * kMaxChainFrames; ++sequence) {
    chain.add(delta(sequence), kLongestChainNs + sequence);
    EXPECT_LE(chain.frames().size(), kMaxChainFrames + 1);
  }
  EXPECT_TRUE(chain.frames().empty());
}

TEST(FrameChain, IsBoundedInBytes) {
  FrameChain chain;
  chain.add(keyframe(1), 0);
  chain.add(delta(2, kMaxChainBytes / 2), 1);
  EXPECT_EQ(chain.frames().size(), 2u);
  chain.add(delta(3, kMaxChainBytes), 2);
  EXPECT_TRUE(chain.frames().empty());
}

}  // namespace
}  // namespace strandcast::frame_chain_test
