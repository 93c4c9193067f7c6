// Laws of the send queue: order of joining, one frame pending, and that a viewer only ever gets deltas it can
// decode.
#include "server/net/send_queue.h"

#include <gtest/gtest.h>

#include <random>

namespace strandcast::send_queue_test {
namespace {

EncodedFramePtr frame(Opcode opcode, uint32_t sequence, uint32_t base_sequence) {
  auto result = std::make_shared<EncodedFrame>();
  result->header.opcode = opcode;
  result->header.sequence = sequence;
  result->header.base_sequence = base_sequence;
  return result;
}
EncodedFramePtr delta(uint32_t sequence) {
  return frame(Opcode::StrandDelta, sequence, sequence - 1);
}
EncodedFramePtr keyframe(uint32_t sequence) {
  return frame(Opcode::StrandKeyframe, sequence, 0);
}

Opcode taken_opcode(SendQueue& queue) {
  const auto item = queue.take_next();
  if (!item) return Opcode::Asset;
  const auto* media = std::get_if<EncodedFramePtr>(&*item);
  return media == nullptr ? Opcode::Control : (*media)->header.opcode;
}

TEST(SendQueue, SendsWelcomeThenAssetThenKeyframeThenDeltas) {
  SendQueue queue;
  queue.set_asset(frame(Opcode::Asset, 1, 0));
  queue.start_strands();
  ASSERT_TRUE(queue.push_control(Welcome{}));
  EXPECT_EQ(queue.offer_strands(delta(5)), SendQueue::Offer::Ignored);
  EXPECT_EQ(queue.offer_strands(keyframe(5)), SendQueue::Offer::Ignored) << "the asset is not written yet";
  EXPECT_EQ(taken_opcode(queue), Opcode::Control);
  queue.written();
  EXPECT_EQ(taken_opcode(queue), Opcode::Asset);
  EXPECT_FALSE(queue.needs_keyframe()) << "while the asset is being written";
  queue.written();
  EXPECT_TRUE(queue.needs_keyframe());
  EXPECT_EQ(queue.offer_strands(delta(6)), SendQueue::Offer::Ignored);
  EXPECT_EQ(queue.offer_strands(keyframe(6)), SendQueue::Offer::Queued);
  EXPECT_EQ(taken_opcode(queue), Opcode::StrandKeyframe);
  EXPECT_EQ(queue.offer_strands(delta(7)), SendQueue::Offer::Queued);
  queue.written();
  EXPECT_EQ(taken_opcode(queue), Opcode::StrandDelta);
  EXPECT_EQ(queue.dropped_frames(), 0u);
}

TEST(SendQueue, ExactFramesWaitWhileALinkStandsStill) {
  const auto exact = [](uint32_t sequence, size_t bytes) {
    auto made = std::make_shared<EncodedFrame>(*delta(sequence));
    made->message.resize(bytes);
    made->message[0] = std::byte{static_cast<uint8_t>(Opcode::StrandDelta)};
    made->message[kFrameHeaderBytes] = std::byte{128};  // WIRE.md: the frame is exact
    return made;
  };
  SendQueue queue;
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(keyframe(1)), SendQueue::Offer::Queued);
  (void)queue.take_next();
  uint32_t sequence = 2;
  while (queue.offer_strands(exact(sequence, 80)) == SendQueue::Offer::Queued) ++sequence;
  EXPECT_EQ(sequence, 2 + 1 + kWaitingExactFrames) << "one in front";
  EXPECT_EQ(queue.chain_losses(), 1u);

  SendQueue other;
  other.start_strands();
  ASSERT_EQ(other.offer_strands(keyframe(1)), SendQueue::Offer::Queued);
  (void)other.take_next();
  ASSERT_EQ(other.offer_strands(exact(2, 80)), SendQueue::Offer::Queued);
  EXPECT_EQ(other.offer_strands(exact(3, 4'000)), SendQueue::Offer::LostChain) << "too large to be one";
}

TEST(SendQueue, SecondPendingDeltaLosesTheChainAndIsCounted) {
  SendQueue queue;
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(keyframe(1)), SendQueue::Offer::Queued);
  (void)queue.take_next();
  ASSERT_EQ(queue.offer_strands(delta(2)), SendQueue::Offer::Queued);
  EXPECT_EQ(queue.offer_strands(delta(3)), SendQueue::Offer::LostChain);
  EXPECT_EQ(queue.dropped_frames(), 2u);
  EXPECT_EQ(queue.chain_losses(), 1u);
  EXPECT_EQ(queue.offer_strands(delta(4)), SendQueue::Offer::Ignored);
  queue.written();
  EXPECT_TRUE(queue.needs_keyframe());
  EXPECT_FALSE(queue.take_next().has_value()) << "nothing of the broken chain may follow";
}

EncodedFramePtr sized(const EncodedFramePtr& frame, size_t bytes) {
  auto result = std::make_shared<EncodedFrame>(*frame);
  result->message.resize(bytes);
  return result;
}

// A thin link takes seconds for a keyframe, and what came meanwhile costs less than another keyframe.
TEST(SendQueue, DeltasWaitForAKeyframeThatIsWrittenAsLongAsTheyAreSmallerThanIt) {
  SendQueue queue;
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(sized(keyframe(1), 1'000)), SendQueue::Offer::Queued);
  EXPECT_EQ(taken_opcode(queue), Opcode::StrandKeyframe);
  for (uint32_t sequence = 2; sequence < 12; ++sequence)
    EXPECT_EQ(queue.offer_strands(sized(delta(sequence), 100)), SendQueue::Offer::Queued) << sequence;
  queue.written();
  for (uint32_t sequence = 2; sequence < 12; ++sequence) {
    EXPECT_EQ(taken_opcode(queue), Opcode::StrandDelta) << sequence;
    queue.written();
  }
  EXPECT_FALSE(queue.take_next());
  // After it one waits at most, as ever.
  ASSERT_EQ(queue.offer_strands(sized(delta(12), 100)), SendQueue::Offer::Queued);
  EXPECT_EQ(queue.offer_strands(sized(delta(13), 100)), SendQueue::Offer::LostChain);
  EXPECT_EQ(queue.dropped_frames(), 2u);

  SendQueue full;
  full.start_strands();
  ASSERT_EQ(full.offer_strands(sized(keyframe(1), 1'000)), SendQueue::Offer::Queued);
  EXPECT_EQ(taken_opcode(full), Opcode::StrandKeyframe);
  for (uint32_t sequence = 2; sequence < 12; ++sequence)
    (void)full.offer_strands(sized(delta(sequence), 100));
  EXPECT_EQ(full.offer_strands(sized(delta(12), 100)), SendQueue::Offer::LostChain)
      << "a keyframe is cheaper";
}

TEST(SendQueue, KeyframeForAnotherViewerIsIgnoredByAViewerWithThatState) {
  SendQueue queue;
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(keyframe(4)), SendQueue::Offer::Queued);
  (void)queue.take_next();
  queue.written();
  EXPECT_EQ(queue.offer_strands(keyframe(4)), SendQueue::Offer::Ignored);
  EXPECT_EQ(queue.offer_strands(delta(5)), SendQueue::Offer::Queued);
}

TEST(SendQueue, AChainGoesOutWholeAndWhatComesMeanwhileBehindIt) {
  SendQueue queue;
  queue.start_strands();
  const std::vector<EncodedFramePtr> chain = {keyframe(1), delta(2), delta(3)};
  ASSERT_EQ(queue.offer_chain(chain), SendQueue::Offer::Queued);
  EXPECT_EQ(queue.offer_strands(delta(4)), SendQueue::Offer::Queued);
  for (uint32_t sequence = 1; sequence <= 4; ++sequence) {
    const auto item = queue.take_next();
    ASSERT_TRUE(item);
    EXPECT_EQ(std::get<EncodedFramePtr>(*item)->header.sequence, sequence);
    queue.written();
  }
  // From here on one may wait, as ever.
  EXPECT_EQ(queue.offer_strands(delta(5)), SendQueue::Offer::Queued);
  EXPECT_EQ(queue.offer_strands(delta(6)), SendQueue::Offer::LostChain);
}

TEST(SendQueue, WhoDoesNotCatchUpWithAChainLosesIt) {
  SendQueue queue;
  queue.start_strands();
  const std::vector<EncodedFramePtr> chain = {keyframe(1), delta(2), delta(3)};
  ASSERT_EQ(queue.offer_chain(chain), SendQueue::Offer::Queued);
  uint32_t sequence = 4;
  while (queue.offer_strands(delta(sequence)) == SendQueue::Offer::Queued) ++sequence;
  EXPECT_EQ(sequence, 4 + 2 * kCatchUpFrames) << "so many for each delta of the chain";
  EXPECT_FALSE(queue.take_next().has_value()) << "nothing of the broken chain may follow";
  EXPECT_TRUE(queue.needs_keyframe());
}

// Hair of another shape: what waits was of the one before.
TEST(SendQueue, AnotherAssetDropsWhatWaitsAndAKeyframeFollowsIt) {
  SendQueue queue;
  queue.start_strands();
  const std::vector<EncodedFramePtr> chain = {keyframe(1), delta(2), delta(3)};
  ASSERT_EQ(queue.offer_chain(chain), SendQueue::Offer::Queued);
  (void)queue.take_next();
  queue.renew_asset(frame(Opcode::Asset, 1, 0));
  EXPECT_EQ(queue.offer_strands(delta(4)), SendQueue::Offer::Ignored);
  queue.written();
  EXPECT_EQ(queue.offer_strands(keyframe(4)), SendQueue::Offer::Ignored) << "the asset waits";
  queue.renew_asset(frame(Opcode::Asset, 2, 0));
  const auto item = queue.take_next();
  ASSERT_TRUE(item);
  EXPECT_EQ(std::get<EncodedFramePtr>(*item)->header.opcode, Opcode::Asset);
  EXPECT_EQ(std::get<EncodedFramePtr>(*item)->header.sequence, 2u) << "the newest alone";
  queue.written();
  EXPECT_FALSE(queue.take_next().has_value()) << "nothing of the old shape";
  EXPECT_TRUE(queue.needs_keyframe());
  EXPECT_EQ(queue.offer_strands(keyframe(1)), SendQueue::Offer::Queued) << "of an encoder that begins anew";
  EXPECT_EQ(queue.dropped_frames(), 2u);
}

TEST(SendQueue, AChainIsForOneThatWaitsForAKeyframe) {
  SendQueue queue;
  const std::vector<EncodedFramePtr> chain = {keyframe(1), delta(2)};
  EXPECT_EQ(queue.offer_chain(chain), SendQueue::Offer::Ignored) << "no strands are wanted";
  queue.start_strands();
  EXPECT_EQ(queue.offer_chain({}), SendQueue::Offer::Ignored);
  ASSERT_EQ(queue.offer_strands(keyframe(7)), SendQueue::Offer::Queued);
  EXPECT_EQ(queue.offer_chain(chain), SendQueue::Offer::Ignored) << "it has one";
}

TEST(SendQueue, ARelayGetsKeyframesForOthersToo) {
  SendQueue queue;
  queue.take_all();
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(keyframe(1)), SendQueue::Offer::Queued);
  ASSERT_EQ(queue.offer_strands(delta(2)), SendQueue::Offer::Queued);
  ASSERT_EQ(queue.offer_strands(keyframe(2)), SendQueue::Offer::Queued) << "for who joins there";
  ASSERT_EQ(queue.offer_strands(delta(3)), SendQueue::Offer::Queued);
  for (const Opcode opcode :
       {Opcode::StrandKeyframe, Opcode::StrandDelta, Opcode::StrandKeyframe, Opcode::StrandDelta}) {
    EXPECT_EQ(taken_opcode(queue), opcode);
    queue.written();
  }
  // It is not waited for without end.
  uint32_t sequence = 4;
  while (queue.offer_strands(delta(sequence)) == SendQueue::Offer::Queued) ++sequence;
  EXPECT_EQ(sequence, 4 + 1 + kMaxRelayFrames);
  EXPECT_TRUE(queue.needs_keyframe());
}

TEST(SendQueue, WhateverIsOfferedTheViewerCanDecodeWhatItGets) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    SendQueue queue;
    queue.set_asset(frame(Opcode::Asset, 1, 0));
    queue.start_strands();
    uint32_t sequence = 1;
    uint32_t decoded_sequence = 0;  // 0 = the viewer has no state
    bool is_writing = false;
    for (int step = 0; step < 200; ++step) {
      switch (random() % 5) {
        case 0:
        case 1:
          queue.offer_strands(delta(++sequence));
          break;
        case 2:
          if (random() % 4 == 0) queue.offer_strands(keyframe(sequence));
          break;
        case 3:
          if (random() % 50 == 0) queue.lose_chain();
          break;
        default:
          if (is_writing) queue.written();
          is_writing = false;
          if (const auto item = queue.take_next()) {
            is_writing = true;
            const FrameHeader& header = std::get<EncodedFramePtr>(*item)->header;
            if (header.opcode == Opcode::Asset) break;
            if (header.opcode == Opcode::StrandDelta) {
              ASSERT_EQ(header.base_sequence, decoded_sequence);
              ASSERT_NE(decoded_sequence, 0u);
            }
            decoded_sequence = header.sequence;
          }
      }
    }
  }
}

TEST(SendQueue, ControlIsBoundedAndGoesAheadOfMedia) {
  SendQueue queue;
  queue.set_asset(frame(Opcode::Asset, 1, 0));
  for (size_t i = 0; i < kMaxQueuedControl; ++i) ASSERT_TRUE(queue.push_control(Notice{}));
  EXPECT_FALSE(queue.push_control(Notice{}));
  for (size_t i = 0; i < kMaxQueuedControl; ++i) EXPECT_EQ(taken_opcode(queue), Opcode::Control);
  EXPECT_TRUE(queue.take_next().has_value());
  EXPECT_FALSE(queue.take_next().has_value());
}

// A client that reads slowly while somebody drags a slider has its place, and sees what it came to.
TEST(SendQueue, OfTheLooksThatWaitOnlyTheNewestIsSent) {
  SendQueue queue;
  LookChange look;
  for (size_t i = 1; i <= 10 * kMaxQueuedControl; ++i) {
    look.look.exposure = static_cast<float>(i);
    ASSERT_TRUE(queue.push_control(look)) << i;
    if (i == 1) {
      ASSERT_TRUE(queue.push_control(Notice{false, "between"}));
    }
  }
  const auto taken = [&] {
    const auto item = queue.take_next();
    queue.written();
    return std::get<ServerMessage>(*item);
  };
  EXPECT_EQ(taken(), ServerMessage(Notice{false, "between"}));
  EXPECT_EQ(taken(), ServerMessage(look));
  EXPECT_FALSE(queue.take_next().has_value());
}

PicturePtr picture(uint32_t sequence, uint32_t base_sequence) {
  return make_picture(frame(Opcode::Vp8Frame, sequence, base_sequence));
}

uint32_t taken_picture(SendQueue& queue) {
  const auto item = queue.take_next();
  queue.written();
  return item ? std::get<EncodedFramePtr>(*item)->header.sequence : 0;
}

TEST(SendQueue, NewestPictureReplacesTheOneNotYetSent) {
  SendQueue queue;
  queue.set_asset(frame(Opcode::Asset, 1, 0));
  queue.start_pictures();
  queue.offer_picture(picture(1, 0));
  EXPECT_EQ(taken_opcode(queue), Opcode::Asset) << "a picture never replaces the asset";
  queue.written();
  queue.offer_picture(picture(2, 0));
  queue.offer_picture(picture(3, 0));
  EXPECT_EQ(taken_picture(queue), 3u);
  EXPECT_EQ(queue.dropped_frames(), 2u);
  EXPECT_EQ(queue.offer_picture(picture(3, 0)), SendQueue::Offer::Ignored) << "it was sent";
}

TEST(SendQueue, PicturesAreForThoseWhoWantThem) {
  SendQueue queue;
  EXPECT_FALSE(queue.needs_picture());
  EXPECT_EQ(queue.offer_picture(picture(1, 0)), SendQueue::Offer::Ignored);
  queue.start_pictures();
  EXPECT_TRUE(queue.needs_picture());
  EXPECT_EQ(queue.offer_picture(picture(5, 4)), SendQueue::Offer::Ignored) << "nothing to build on";
  EXPECT_EQ(queue.dropped_frames(), 0u);
  EXPECT_EQ(queue.offer_picture(picture(6, 0)), SendQueue::Offer::Queued);
  EXPECT_FALSE(queue.needs_picture());
}

TEST(SendQueue, AVideoPictureWithoutAPlaceCostsTheChain) {
  SendQueue queue;
  queue.start_pictures();
  queue.offer_picture(picture(1, 0));
  EXPECT_EQ(taken_picture(queue), 1u);
  EXPECT_EQ(queue.offer_picture(picture(2, 1)), SendQueue::Offer::Queued);
  EXPECT_EQ(queue.offer_picture(picture(3, 2)), SendQueue::Offer::LostChain) << "2 is still waiting";
  EXPECT_EQ(queue.chain_losses(), 1u);
  EXPECT_EQ(queue.dropped_frames(), 2u);
  EXPECT_TRUE(queue.needs_picture());
  EXPECT_EQ(queue.offer_picture(picture(4, 3)), SendQueue::Offer::Ignored);
  EXPECT_EQ(queue.offer_picture(picture(5, 0)), SendQueue::Offer::Queued);
  EXPECT_EQ(taken_picture(queue), 5u);
  EXPECT_EQ(queue.offer_picture(picture(6, 5)), SendQueue::Offer::Queued);
}

TEST(SendQueue, AnotherClassStartsWithAWholePicture) {
  SendQueue queue;
  queue.start_pictures();
  queue.offer_picture(picture(7, 0));
  EXPECT_EQ(taken_picture(queue), 7u);
  queue.offer_picture(picture(8, 7));
  queue.start_pictures();
  EXPECT_EQ(queue.offer_picture(picture(8, 7)), SendQueue::Offer::Ignored) << "numbers of another class";
  EXPECT_EQ(queue.offer_picture(picture(7, 0)), SendQueue::Offer::Queued);
  EXPECT_EQ(taken_picture(queue), 7u);
}

TEST(SendQueue, ThePictureOfAChangeReplacesTheStrandsThatWait) {
  SendQueue queue;
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(keyframe(7)), SendQueue::Offer::Queued);
  queue.start_pictures();
  EXPECT_TRUE(queue.awaits_picture());
  EXPECT_FALSE(queue.needs_picture()) << "strands go on until it is here";
  EXPECT_EQ(queue.offer_picture(picture(3, 0)), SendQueue::Offer::Queued);
  EXPECT_FALSE(queue.awaits_picture());
  EXPECT_TRUE(queue.stop_strands());
  EXPECT_EQ(taken_picture(queue), 3u);
  EXPECT_FALSE(queue.take_next().has_value());
}

TEST(SendQueue, StoppingPicturesDropsTheOneThatWaits) {
  SendQueue queue;
  queue.start_pictures();
  queue.offer_picture(picture(1, 0));
  queue.start_strands();
  EXPECT_EQ(queue.offer_strands(keyframe(7)), SendQueue::Offer::Queued);
  queue.stop_pictures();
  EXPECT_EQ(queue.dropped_frames(), 1u);
  EXPECT_EQ(taken_opcode(queue), Opcode::StrandKeyframe);
  EXPECT_EQ(queue.offer_picture(picture(2, 0)), SendQueue::Offer::Ignored);
  EXPECT_FALSE(queue.awaits_picture());
}

TEST(SendQueue, StoppingStrandsDropsWhatWaitsAndSaysWhetherTheAssetDid) {
  SendQueue queue;
  queue.set_asset(frame(Opcode::Asset, 1, 0));
  queue.start_strands();
  EXPECT_FALSE(queue.stop_strands()) << "the asset was still to be sent";
  EXPECT_FALSE(queue.take_next().has_value());
  queue.start_strands();
  ASSERT_EQ(queue.offer_strands(keyframe(7)), SendQueue::Offer::Queued);
  EXPECT_TRUE(queue.stop_strands());
  EXPECT_EQ(queue.offer_strands(delta(8)), SendQueue::Offer::Ignored);
  queue.start_pictures();
  queue.offer_picture(picture(1, 0));
  EXPECT_EQ(taken_picture(queue), 1u);
}

}  // namespace
}  // namespace strandcast::send_queue_test
