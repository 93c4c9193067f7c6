#include "server/stream/demand_book.h"

#include <cmath>

namespace strandcast::demand_book_test {
namespace {

PictureView sized(uint32_t width) {
  PictureView view;
  view.size = {width, 64};
  return view;
}

Demand wants(std::optional<uint16_t> strand_stream, std::optional<PictureView> picture = std::nullopt) {
  Demand demand;
  demand.strand_stream = strand_stream;
  demand.picture = picture;
  return demand;
}

TEST(DemandBook, WhatRunsIsTheUnionOfWhatIsWanted) {
  DemandBook book(sized(640), kHardwareBudget);
  const ReaderId a = book.add({}), b = book.add({}), c = book.add({});
  EXPECT_FALSE(book.total().is_watched());
  EXPECT_TRUE(book.strand_streams().empty());
  ASSERT_TRUE(book.set_demand(a, wants(3)).ok());
  ASSERT_TRUE(book.set_demand(b, wants(3)).ok());
  EXPECT_EQ(book.strand_streams(), std::set<uint16_t>{3});
  EXPECT_EQ(book.strand_readers(3), 2u);
  const auto pictures = book.set_demand(c, wants(std::nullopt, sized(100)));
  ASSERT_TRUE(pictures.ok());
  EXPECT_NE(*pictures, 0u);
  EXPECT_EQ(book.strand_streams(), (std::set<uint16_t>{0, 3})) << "pictures are drawn from stream 0";
  EXPECT_EQ(book.strand_readers(0), 0u) << "which nobody reads";
  EXPECT_EQ(book.total().facts.strand_viewers, 2u);
  EXPECT_EQ(book.total().facts.frame_viewers, 1u);
  for (const ReaderId reader : {a, b, c}) book.remove(reader);
  EXPECT_FALSE(book.total().is_watched());
  EXPECT_TRUE(book.strand_streams().empty());
  EXPECT_TRUE(book.picture_views().empty());
}

TEST(DemandBook, PicturesAreDrawnFromTheStreamThatTheyAreSaidToBe) {
  DemandBook book(sized(640), kHardwareBudget, kStreamsPerCodec);
  const ReaderId strands = book.add({}), pictures = book.add({});
  ASSERT_TRUE(book.set_demand(strands, wants(0)).ok());
  ASSERT_TRUE(book.set_demand(pictures, wants(std::nullopt, sized(100))).ok());
  EXPECT_EQ(book.strand_streams(), (std::set<uint16_t>{0, kStreamsPerCodec}));
  EXPECT_EQ(book.strand_readers(kStreamsPerCodec), 0u) << "which nobody reads";
  book.remove(strands);
  EXPECT_EQ(book.strand_streams(), std::set<uint16_t>{kStreamsPerCodec});
}

TEST(DemandBook, StatesAloneAreReasonEnoughToPublishAndForNothingElse) {
  DemandBook book(sized(640), kHardwareBudget);
  const ReaderId reader = book.add({});
  Demand states;
  states.has_states = true;
  ASSERT_TRUE(book.set_demand(reader, states).ok());
  EXPECT_TRUE(book.total().is_watched());
  EXPECT_TRUE(book.strand_streams().empty());
  (void)book.add({});
  EXPECT_TRUE(book.total().is_watched()) << "whatever others want";
  Demand inputs;
  inputs.has_inputs = true;
  ASSERT_TRUE(book.set_demand(reader, inputs).ok());
  EXPECT_FALSE(book.total().is_watched()) << "inputs come whoever watches";
}

// What is simulated follows the largest screen; who says nothing may look closely.
TEST(DemandBook, HairIsAsLargeAsOnTheLargestScreen) {
  DemandBook book(sized(640), kHardwareBudget);
  EXPECT_EQ(book.total().hair_px, 0.0) << "nobody";
  const ReaderId strands = book.add({}), pictures = book.add({}), recorder = book.add({});
  Demand told = wants(0);
  told.hair_px = 55.0;
  ASSERT_TRUE(book.set_demand(strands, told).ok());
  EXPECT_EQ(book.total().hair_px, 55.0);
  ASSERT_TRUE(book.set_demand(pictures, wants(std::nullopt, sized(640))).ok());
  EXPECT_TRUE(std::isinf(book.total().hair_px)) << "nobody knows the hair";
  book.set_hair({glm::vec3(0.0f), 0.2f, 0.3f});
  const double near_px = book.total().hair_px;
  EXPECT_TRUE(near_px > 0.0 && !std::isinf(near_px));
  PictureView far = sized(640);
  far.camera.offset_m *= 100.0f;
  ASSERT_TRUE(book.set_demand(pictures, wants(std::nullopt, far)).ok());
  EXPECT_EQ(book.total().hair_px, 55.0) << "the other one's screen";
  Demand states;
  states.has_states = true;
  states.hair_px = 1.0;
  ASSERT_TRUE(book.set_demand(recorder, states).ok());
  EXPECT_TRUE(std::isinf(book.total().hair_px)) << "what is recorded may be looked at closely later";
  book.remove(recorder);
  ASSERT_TRUE(book.set_demand(strands, wants(0)).ok());
  EXPECT_TRUE(std::isinf(book.total().hair_px)) << "an older viewer";
}

TEST(DemandBook, ARefusedDemandLeavesTheOneBefore) {
  DemandBook book(sized(640), kHardwareBudget);
  const ReaderId reader = book.add({});
  ASSERT_TRUE(book.set_demand(reader, wants(1, sized(100))).ok());
  const PictureClass picture_class = book.picture_class_of(reader);
  EXPECT_FALSE(book.set_demand(reader, wants(2, sized(1))).ok()) << "too narrow";
  EXPECT_EQ(book.demand_of(reader).strand_stream, 1);
  EXPECT_EQ(book.demand_of(reader).picture, sized(100));
  EXPECT_EQ(book.picture_class_of(reader), picture_class);
  EXPECT_EQ(book.set_demand(99, wants(1)).error().code, ErrorCode::NotFound);
}

TEST(DemandBook, SharesGoByTheReadersAddress) {
  DemandBook book(sized(640), kHardwareBudget);
  ReaderId last = 0;
  for (uint32_t i = 0; i < kMaxPictureViewsOfPeer; ++i) {
    last = book.add({"a", true});
    ASSERT_TRUE(book.set_demand(last, wants(std::nullopt, sized(100 + i))).ok());
  }
  EXPECT_FALSE(book.set_demand(book.add({"a", true}), wants(std::nullopt, sized(200))).ok());
  EXPECT_TRUE(book.set_demand(book.add({"b", true}), wants(std::nullopt, sized(200))).ok());
  EXPECT_TRUE(book.set_demand(last, wants(std::nullopt, sized(300))).ok()) << "one for another of its own";
}

}  // namespace
}  // namespace strandcast::demand_book_test
