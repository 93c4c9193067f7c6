// Recordings: the bytes of the file, its reader in a whole, a cut and a damaged one, and the file on disk.
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstring>
#include <random>

#include "common/base/crc32.h"
#include "common/base/file.h"
#include "common/record/byte_source.h"
#include "common/record/chunk_list.h"
#include "common/record/record_file.h"
#include "common/record/recording_check.h"
#include "common/record/recording_reader.h"
#include "tests/support/sample_recording.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::recording_test {
namespace {

using test::sample_asset_frame;
using test::sample_recorded_messages;
using test::sample_recording;
using test::sample_start;
using testing::HasSubstr;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

Result<std::unique_ptr<RecordingReader>> open_bytes(mcap::Bytes bytes,
                                                    RecordedPart part = RecordedPart::All) {
  return RecordingReader::open(memory_byte_source(std::move(bytes)), part);
}

/// What can be read, as sequences of frames and encoded messages, in order.
std::vector<std::string> read_all(RecordingReader& reader) {
  std::vector<std::string> items;
  while (true) {
    const auto item = reader.next();
    if (!item) {
      items.push_back(item.error().to_string());
      continue;
    }
    if (!*item) return items;
    if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what)) {
      items.push_back(fmt::format("frame {}", frame->frame->header.sequence));
    } else {
      const auto bytes = encode(std::get<RecordedMessage>((*item)->what));
      items.push_back(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    }
  }
}

std::vector<std::string> read_all(mcap::Bytes bytes) {
  const auto reader = open_bytes(std::move(bytes));
  EXPECT_TRUE(reader) << reader.error().to_string();
  return reader ? read_all(**reader) : std::vector<std::string>();
}

/// Of the n-th chunk of the sample.
ChunkPlace chunk_of(const mcap::Bytes& bytes, size_t n) {
  const auto source = memory_byte_source(bytes);
  const auto list = list_chunks(*source);
  EXPECT_TRUE(list && list->chunks.size() > n);
  return list->chunks.at(n);
}

template <class T>
void put_at(mcap::Bytes& bytes, uint64_t offset, T value) {
  ASSERT_LE(offset + sizeof(T), bytes.size());
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

TEST(Crc32, IsThatOfZlib) {
  // The check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms.
  EXPECT_EQ(crc32(bytes_of("123456789")), 0xCBF43926u);
  EXPECT_EQ(crc32({}), 0u);
  const std::string text = "The quick brown fox jumps over the lazy dog";
  EXPECT_EQ(crc32(bytes_of(text)), 0x414FA339u);
  for (size_t cut = 0; cut <= text.size(); ++cut)
    EXPECT_EQ(crc32(bytes_of(text).subspan(cut), crc32(bytes_of(text).first(cut))), 0x414FA339u);
  for (size_t cut = 0; cut <= text.size(); ++cut)
    EXPECT_EQ(
        joined_crc32(crc32(bytes_of(text).first(cut)), crc32(bytes_of(text).subspan(cut)), text.size() - cut),
        0x414FA339u);
}

/// A second of a run: steps, states and inputs that have nothing in common, and deltas likewise.
TEST(RecordingWriter, TakesLittleMoreThanWhatItIsGiven) {
  constexpr int kSeconds = 10, kPerSecond = 60;
  test::MemorySink sink;
  RecordingWriter writer(sink, sample_start(), *sample_asset_frame());
  const size_t begin_bytes = sink.all.size();
  std::mt19937_64 random(7);
  size_t given_bytes = 0;
  for (int i = 0; i < kSeconds * kPerSecond; ++i) {
    const int64_t time_ns = sample_start().server_time_ns + int64_t{i} * 16'666'667;
    RecordedState state{static_cast<uint64_t>(i), int64_t{i} * 16'666'667, random()};
    writer.add(time_ns, state.sim_time_ns, state);
    given_bytes += sizeof(state.state_hash);
    EncodedFrame frame = test::sample_frame(static_cast<uint32_t>(i) + 1, i == 0, state.sim_time_ns);
    std::vector<std::byte> payload(150);
    for (std::byte& byte : payload) byte = static_cast<std::byte>(random());
    given_bytes += payload.size();
    writer.add(time_ns + 1, *make_encoded_frame(frame.header, payload));
    if (i % kPerSecond == kPerSecond - 1) writer.flush();
  }
  const double over = static_cast<double>(sink.all.size() - begin_bytes - given_bytes) / kSeconds;
  // Two chunks with their indexes, and of each item what its numbers are beside those of the one before. A
  // message of MCAP for each item and its index would take 2 x 60 x 47 bytes.
  EXPECT_LT(over, 1700.0);
}

TEST(RecordingReader, KeepsTheOrderOfWhatStandsInSeveralTopics) {
  test::MemorySink sink;
  RecordingWriter writer(sink, sample_start(), *sample_asset_frame());
  std::vector<std::string> expected;
  const auto add = [&](const RecordedMessage& message) {
    writer.add(sample_start().server_time_ns, 0, message);  // all at the same time
    const auto bytes = encode(message);
    expected.push_back(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  };
  std::mt19937 random(3);
  const std::vector<RecordedMessage> samples = sample_recorded_messages();
  for (uint32_t i = 0; i < 10'000; ++i) {
    if (i == 0 || random() % 20 == 0) {
      const bool is_keyframe = i == 0 || random() % 9 == 0;
      writer.add(sample_start().server_time_ns, test::sample_frame(i + 1, is_keyframe, i));
      expected.push_back(fmt::format("frame {}", i + 1));
    }
    add(samples[random() % samples.size()]);
    if (random() % 1000 == 0) writer.flush();
  }
  writer.finish();
  const std::vector<std::string> found = read_all(sink.all);
  EXPECT_TRUE(found == expected) << found.size() << " of " << expected.size();
}

TEST(RecordingReader, GivesAllInTheOrderOfTime) {
  const auto reader = open_bytes(sample_recording());
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_EQ((*reader)->start(), sample_start());
  const auto asset = (*reader)->asset();
  ASSERT_TRUE(asset) << asset.error().to_string();
  EXPECT_EQ(asset->rest_position_m, sample_asset(4, 3).rest_position_m);
  const RecordingInfo& info = (*reader)->info();
  EXPECT_TRUE(info.is_indexed);
  EXPECT_EQ(info.last_sim_time_ns, 1'900'000'000);
  EXPECT_EQ(info.keyframe_sim_time_ns, (std::vector<int64_t>{0, 1'000'000'000}));
  const RecordingContents contents = (*reader)->contents();
  EXPECT_EQ(contents.at("/states").items, 21u);  // one of the samples is a state
  EXPECT_EQ(contents.at("/strands/keyframes").items, 2u);
  EXPECT_EQ(contents.at("/strands/deltas").items, 18u);
  uint64_t bytes = 0;
  for (const auto& [topic, counted] : contents) bytes += counted.bytes;
  EXPECT_LT(bytes, info.file_bytes);
  int64_t newest_ns = 0;
  uint32_t sequence = 0;
  size_t messages = 0;
  for (auto item = (*reader)->next(); item && *item; item = (*reader)->next()) {
    // Items of a message are told as evenly apart.
    EXPECT_GE((*item)->time_ns, newest_ns - 100'000'000);
    newest_ns = (*item)->time_ns;
    if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what)) {
      EXPECT_EQ(frame->frame->header.sequence, ++sequence);
      EXPECT_EQ(frame->frame->message,
                test::sample_frame(sequence, sequence % 10 == 1, (sequence - 1) * 100'000'000).message);
      // Evenly apart, as they were, but for what a whole nanosecond leaves.
      EXPECT_NEAR(static_cast<double>((*item)->time_ns - sample_start().server_time_ns),
                  (sequence - 1) * 1e8 + 1.0, 2.0);
    } else {
      ++messages;
    }
  }
  EXPECT_EQ(sequence, 20u);
  EXPECT_EQ(messages, sample_recorded_messages().size() + 20);
}

TEST(RecordingReader, GivesTheSameWithoutTheIndex) {
  const mcap::Bytes bytes = sample_recording();
  const auto source = memory_byte_source(bytes);
  const auto walked = walk_chunks(*source);
  ASSERT_TRUE(walked) << walked.error().to_string();
  EXPECT_TRUE(walked->has_end);
  mcap::Bytes cut = bytes;
  cut.resize(walked->data_end);  // as a server leaves it that is killed
  const auto reader = open_bytes(cut);
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_FALSE((*reader)->info().is_indexed);
  EXPECT_EQ((*reader)->info().cut_bytes, 0u);
  EXPECT_EQ((*reader)->contents().at("/strands/deltas").items, 18u);
  EXPECT_EQ(read_all(**reader), read_all(bytes));
}

/// The beginning of bytes that somebody else holds.
class CutSource : public ByteSource {
 public:
  CutSource(const mcap::Bytes& bytes, size_t size) : bytes_(std::span(bytes).first(size)) {}
  uint64_t size_bytes() const override { return bytes_.size(); }
  Status read(uint64_t offset, std::span<std::byte> destination) override {
    if (offset > bytes_.size() || destination.size() > bytes_.size() - offset)
      return make_error(ErrorCode::BadInput, "past the end");
    std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(offset), destination.size(), destination.begin());
    return {};
  }

 private:
  const std::span<const std::byte> bytes_;
};

TEST(RecordingReader, ReadsToTheCutWhereverItIs) {
  const mcap::Bytes bytes = test::without_schemas(sample_recording());
  const std::vector<std::string> all = read_all(bytes);
  size_t most = 0;
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto reader = RecordingReader::open(std::make_unique<CutSource>(bytes, size));
    if (!reader) {
      EXPECT_EQ(most, 0u) << "cut to " << size << ": " << reader.error().to_string();
      continue;
    }
    EXPECT_FALSE((*reader)->info().is_indexed);
    const std::vector<std::string> items = read_all(**reader);
    EXPECT_GE(items.size(), most) << "cut to " << size;
    // What is there is there once, and unchanged.
    for (const std::string& item : items)
      ASSERT_EQ(std::count(all.begin(), all.end(), item), std::count(items.begin(), items.end(), item))
          << "cut to " << size;
    most = items.size();
  }
  EXPECT_EQ(most, all.size());
}

TEST(RecordingReader, SeeksTheLastKeyframeBefore) {
  for (const bool is_cut : {false, true}) {
    mcap::Bytes bytes = sample_recording();
    if (is_cut) bytes.resize(bytes.size() - 1);
    const auto reader = open_bytes(bytes);
    ASSERT_TRUE(reader);
    const auto first_after = [&](int64_t sim_time_ns) {
      EXPECT_TRUE((*reader)->seek(sim_time_ns));
      uint32_t sequence = 0;
      std::optional<uint64_t> tick;
      for (auto item = (*reader)->next(); item && *item && (sequence == 0 || !tick);
           item = (*reader)->next()) {
        if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what)) {
          if (sequence == 0) sequence = frame->frame->header.sequence;
        } else if (const auto* state =
                       std::get_if<RecordedState>(&std::get<RecordedMessage>((*item)->what))) {
          if (!tick && state->state_hash >= 1000 && state->state_hash < 2000) tick = state->tick;
        }
      }
      return std::pair(sequence, tick.value_or(99));
    };
    EXPECT_EQ(first_after(1'500'000'000), std::pair(11u, uint64_t{11}));
    EXPECT_EQ(first_after(999'999'999), std::pair(1u, uint64_t{0}));
    EXPECT_EQ(first_after(1'000'000'000), std::pair(11u, uint64_t{11}));
    EXPECT_EQ(first_after(-1), std::pair(1u, uint64_t{0}));
    EXPECT_EQ(first_after(INT64_MAX), std::pair(11u, uint64_t{11}));
  }
}

TEST(RecordingReader, TellsADamagedChunkAndGoesOnBehindIt) {
  mcap::Bytes bytes = sample_recording();
  const ChunkPlace second = chunk_of(bytes, 3);  // deltas of the first second
  put_at(bytes, second.offset + second.size_bytes - 5, uint8_t{0xEE});
  const std::vector<std::string> items = read_all(bytes);
  const auto damage = std::find_if(items.begin(), items.end(), [](const std::string& item) {
    return item.find("the chunk at") != std::string::npos || item.find("zstd") != std::string::npos;
  });
  ASSERT_NE(damage, items.end()) << testing::PrintToString(items);
  EXPECT_EQ(std::count(items.begin(), items.end(), "frame 5"), 0);
  EXPECT_EQ(std::count(items.begin(), items.end(), "frame 15"), 1);
}

TEST(RecordingReader, WalksWhereTheIndexPointsOutside) {
  const mcap::Bytes whole = sample_recording();
  mcap::Bytes bytes = whole;
  // The footer: opcode, length, start of the index, start of its offsets, CRC; then the magic.
  const uint64_t footer = bytes.size() - mcap::kMagic.size() - mcap::kFooterBytes;
  put_at(bytes, footer + mcap::kRecordHeadBytes, uint64_t{1} << 62);
  auto reader = open_bytes(bytes);
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_FALSE((*reader)->info().is_indexed);
  EXPECT_THAT((*reader)->info().index_trouble, HasSubstr("outside"));
  EXPECT_EQ(read_all(**reader), read_all(whole));

  // A chunk that the index puts behind the end, its CRC made right again.
  bytes = whole;
  uint64_t summary_start = 0;
  std::memcpy(&summary_start, bytes.data() + footer + mcap::kRecordHeadBytes, sizeof(summary_start));
  uint64_t at = summary_start;
  while (static_cast<mcap::Opcode>(bytes[at]) != mcap::Opcode::ChunkIndex)
    at += mcap::read_record(std::span<const std::byte>(bytes).subspan(at))->size_bytes;
  put_at(bytes, at + mcap::kRecordHeadBytes + 16, uint64_t{1} << 40);
  const auto summary = std::span<const std::byte>(bytes).subspan(
      summary_start, footer + mcap::kFooterBytes - sizeof(uint32_t) - summary_start);
  put_at(bytes, footer + mcap::kFooterBytes - sizeof(uint32_t), crc32(summary));
  reader = open_bytes(bytes);
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_THAT((*reader)->info().index_trouble, HasSubstr("the index names a chunk"));
  EXPECT_EQ(read_all(**reader), read_all(whole));

  bytes = whole;
  put_at(bytes, at + mcap::kRecordHeadBytes, uint8_t{0xEE});  // and not made right
  reader = open_bytes(bytes);
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_THAT((*reader)->info().index_trouble, HasSubstr("the CRC of the index"));
}

TEST(RecordingReader, RefusesWhatIsTooLargeBeforeItTakesMemory) {
  mcap::Bytes bytes = sample_recording();
  const ChunkPlace first = chunk_of(bytes, 1);
  bytes.resize(chunk_of(bytes, 4).offset);                                       // no copy of the asset
  put_at(bytes, first.offset + mcap::kRecordHeadBytes + 16, uint64_t{1} << 50);  // uncompressed_size
  const auto reader = open_bytes(bytes);
  ASSERT_FALSE(reader);
  EXPECT_THAT(reader.error().to_string(), HasSubstr("uncompressed, the limit is"));
}

TEST(RecordingReader, RefusesWhatIsNoRecordingOfOursInOneSentence) {
  const auto sentence = [](mcap::Bytes bytes) {
    const auto reader = open_bytes(std::move(bytes));
    return reader ? std::string("opened") : reader.error().to_string();
  };
  EXPECT_THAT(sentence({}), HasSubstr("this is no MCAP file"));
  const auto text = bytes_of("name: \"walk\" and so on, a scene");
  EXPECT_THAT(sentence({text.begin(), text.end()}), HasSubstr("this is no MCAP file"));
  mcap::Bytes other;
  mcap::append_magic(other);
  mcap::append(mcap::Header{"ros2", "somebody"}, other);
  EXPECT_THAT(sentence(other), HasSubstr("the profile 'ros2'"));

  test::MemorySink sink;
  RecordingStart later = sample_start();
  later.version = 3;
  later.server_version = "9.0.0";
  { const RecordingWriter writer(sink, later, *sample_asset_frame()); }
  EXPECT_THAT(sentence(sink.all), HasSubstr("version 3 of the format, and this program reads 2"));

  test::MemorySink before;
  RecordingStart older = sample_start();
  older.version = 1;
  { const RecordingWriter writer(before, older, *sample_asset_frame()); }
  EXPECT_THAT(sentence(before.all), HasSubstr("version 1 of the format, and this program reads 2: take the "
                                              "program of its server (0.1.0)"));

  test::MemorySink other_hair;
  RecordingStart wrong = sample_start();
  wrong.asset_hash ^= 1;
  { const RecordingWriter writer(other_hair, wrong, *sample_asset_frame()); }
  EXPECT_THAT(sentence(other_hair.all), HasSubstr("is not what its beginning says"));
}

// As of a simulation that stands still while somebody joins.
TEST(RecordingReader, BeginsWithTheFirstOfKeyframesOfOneState) {
  test::MemorySink sink;
  RecordingWriter writer(sink, sample_start(), *sample_asset_frame());
  const int64_t time_ns = sample_start().server_time_ns;
  writer.add(time_ns, 0, RecordedState{0, 0, 7});
  writer.add(time_ns, test::sample_frame(1, true, 0));
  writer.add(time_ns, test::sample_frame(2, true, 0));
  writer.add(time_ns, test::sample_frame(3, false, 10));
  writer.finish();
  const auto reader = open_bytes(sink.all);
  ASSERT_TRUE(reader) << reader.error().to_string();
  const std::vector<std::string> all = read_all(**reader);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[1], "frame 1");
  ASSERT_TRUE((*reader)->seek(5));
  EXPECT_EQ(read_all(**reader), all);
}

TEST(RecordingWriter, SaysInTheFileWhatFoundNoRoom) {
  test::MemorySink sink;
  RecordingWriter writer(sink, sample_start(), *sample_asset_frame());
  sink.is_full = true;
  writer.add(sample_start().server_time_ns, test::sample_frame(1, true, 0));
  writer.add(sample_start().server_time_ns, test::sample_frame(2, false, 10));
  writer.flush();
  EXPECT_EQ(writer.lost().frames, 2u);
  sink.is_full = false;
  writer.add(sample_start().server_time_ns, test::sample_frame(3, true, 20));
  writer.finish();
  const auto reader = open_bytes(sink.all);
  ASSERT_TRUE(reader) << reader.error().to_string();
  std::optional<RecordedLoss> loss;
  std::vector<uint32_t> sequences;
  for (auto item = (*reader)->next(); item && *item; item = (*reader)->next()) {
    if (const auto* frame = std::get_if<RecordedFrame>(&(*item)->what))
      sequences.push_back(frame->frame->header.sequence);
    else if (const auto* lost = std::get_if<RecordedLoss>(&std::get<RecordedMessage>((*item)->what)))
      loss = *lost;
  }
  ASSERT_TRUE(loss);
  EXPECT_EQ(loss->frames, 2u);
  EXPECT_EQ(sequences, std::vector<uint32_t>{3});
}

std::filesystem::path save(const TemporaryFolder& folder, const char* name, const mcap::Bytes& bytes) {
  const std::filesystem::path path = folder.path() / name;
  EXPECT_TRUE(save_file(path, bytes));
  return path;
}

TEST(RecordingCheck, HoldsStrandsAgainstPublishedStates) {
  const TemporaryFolder folder;
  const auto check = check_recording(save(folder, "run.mcap", test::moving_recording(25)));
  ASSERT_TRUE(check) << check.error().to_string();
  EXPECT_TRUE(check->is_sound()) << testing::PrintToString(check->problems);
  EXPECT_TRUE(check->is_whole);
  EXPECT_EQ(check->states, 25u);
  EXPECT_EQ(check->decoded_frames, 25u);
  EXPECT_EQ(check->equal_states, 25u) << "by delta nothing is rounded";
}

TEST(RecordingCheck, FindsEveryByteThatIsWrong) {
  const mcap::Bytes whole = test::without_schemas(test::moving_recording(12));
  // Lengths and times of an index that stands beside its chunk say nothing that is not said elsewhere; they
  // are under the CRC of all data.
  for (size_t i = 0; i < whole.size(); i += 7) {
    mcap::Bytes bytes = whole;
    bytes[i] ^= std::byte{0x20};
    const auto source = memory_byte_source(bytes);
    const auto check = check_recording(*source);
    EXPECT_FALSE(check && check->is_sound()) << "byte " << i << " of " << whole.size();
  }
}

TEST(RecordingCheck, TellsAnEndThatIsMissingFromDamage) {
  const mcap::Bytes whole = test::moving_recording(25);
  const auto source = memory_byte_source(whole);
  const auto walked = walk_chunks(*source);
  ASSERT_TRUE(walked);
  const uint64_t last = walked->chunks.back().offset;
  const auto check_first = [](mcap::Bytes bytes, uint64_t size) {
    bytes.resize(static_cast<size_t>(size));
    const auto part = memory_byte_source(std::move(bytes));
    const auto check = check_recording(*part);
    EXPECT_TRUE(check) << check.error().to_string();
    return check ? *check : RecordingCheck{};
  };
  // As a file is while it is written, between two records or within one.
  for (const uint64_t size : {last, last + 1, last + 30, whole.size() - 1}) {
    const RecordingCheck check = check_first(whole, size);
    EXPECT_FALSE(check.is_sound()) << size;
    EXPECT_EQ(check.is_sound_so_far(), size < whole.size() - 1)
        << size << testing::PrintToString(check.problems);
  }
  EXPECT_FALSE(check_first(whole, whole.size()).is_sound_so_far()) << "it is whole";
  mcap::Bytes damaged = whole;
  const ChunkPlace chunk = chunk_of(damaged, 4);
  put_at(damaged, chunk.offset + chunk.size_bytes - 3, uint8_t{0x5A});
  EXPECT_FALSE(check_first(damaged, last).is_sound_so_far());
}

TEST(RecordingRecover, MakesAWholeFileOfOneThatWasCutOff) {
  const TemporaryFolder folder;
  const mcap::Bytes whole = test::moving_recording(25);
  const auto source = memory_byte_source(whole);
  const auto walked = walk_chunks(*source);
  ASSERT_TRUE(walked);
  const uint64_t last = walked->chunks.back().offset;
  const auto cut =
      save(folder, "cut.mcap", mcap::Bytes(whole.begin(), whole.begin() + static_cast<ptrdiff_t>(last + 30)));
  EXPECT_FALSE(check_recording(cut)->is_sound());
  const auto recovery = recover_recording(cut, folder.path() / "whole.mcap");
  ASSERT_TRUE(recovery) << recovery.error().to_string();
  EXPECT_TRUE(recovery->check.is_sound()) << testing::PrintToString(recovery->check.problems);
  EXPECT_TRUE(recovery->check.is_whole);
  EXPECT_EQ(recovery->kept_chunks, walked->chunks.size() - 1);
  EXPECT_EQ(recovery->cut_bytes, 30u);
  const auto before = RecordingReader::open(cut);
  const auto after = RecordingReader::open(folder.path() / "whole.mcap");
  ASSERT_TRUE(before && after);
  EXPECT_EQ(read_all(**before), read_all(**after));
  EXPECT_FALSE(recover_recording(cut, folder.path() / "whole.mcap")) << "nothing is replaced";
}

TEST(RecordingRecover, LeavesOutWhatIsDamagedAndWhatCannotBeDecodedWithoutIt) {
  const TemporaryFolder folder;
  const mcap::Bytes whole = test::moving_recording(45);
  const auto source = memory_byte_source(whole);
  const auto walked = walk_chunks(*source);
  ASSERT_TRUE(walked);
  size_t damaged_deltas = 0;
  for (const ChunkPlace& place : walked->chunks) {
    mcap::Bytes bytes = whole;
    put_at(bytes, place.offset + place.size_bytes - 3, uint8_t{0x5A});
    const std::filesystem::path to = folder.path() / fmt::format("{}.mcap", place.offset);
    const auto recovery = recover_recording(save(folder, "run.mcap", bytes), to);
    ASSERT_TRUE(recovery) << recovery.error().to_string();
    EXPECT_EQ(recovery->left_out_chunks, 1u);
    EXPECT_TRUE(recovery->check.is_whole);
    EXPECT_TRUE(recovery->check.is_sound()) << testing::PrintToString(recovery->check.problems);
    EXPECT_GE(recovery->check.decoded_frames, 35u) << "more than the second that was damaged is lost";
    damaged_deltas += place.channel == kDeltaChannel ? 1 : 0;
  }
  EXPECT_GT(damaged_deltas, 3u);
}

TEST(RecordingRecover, KeepsInputsAndStepsWhereTheHairIsLost) {
  const TemporaryFolder folder;
  mcap::Bytes bytes = test::moving_recording(25);
  const auto source = memory_byte_source(bytes);
  const auto walked = walk_chunks(*source);
  ASSERT_TRUE(walked);
  for (const ChunkPlace& place : walked->chunks)
    if (place.channel == kAssetChannel) put_at(bytes, place.offset + place.size_bytes - 3, uint8_t{0x5A});
  const auto recovery = recover_recording(save(folder, "run.mcap", bytes), folder.path() / "out.mcap");
  ASSERT_TRUE(recovery) << recovery.error().to_string();
  EXPECT_EQ(recovery->left_out_chunks, 2u);
  EXPECT_EQ(recovery->left_out_frames, 25u);
  EXPECT_EQ(recovery->check.states, 25u);
  EXPECT_THAT(recovery->check.problems, testing::Contains(HasSubstr("strands cannot")));
  const auto messages = RecordingReader::open(folder.path() / "out.mcap", RecordedPart::Messages);
  ASSERT_TRUE(messages) << messages.error().to_string();
  EXPECT_FALSE((*messages)->asset());
  EXPECT_EQ(read_all(**messages).size(), 25u + 24u) << "states and steps";
}

// What stands in front stands at the end once more.
TEST(RecordingReader, NeedsNeitherTheFirstStartNorTheFirstAsset) {
  const mcap::Bytes whole = sample_recording();
  const std::vector<std::string> all = read_all(whole);
  for (const size_t first : {0, 1}) {
    const ChunkPlace place = chunk_of(whole, first);
    mcap::Bytes bytes = whole;
    put_at(bytes, place.offset + place.size_bytes - 3, uint8_t{0x5A});
    const auto reader = open_bytes(bytes);
    ASSERT_TRUE(reader) << reader.error().to_string();
    EXPECT_TRUE((*reader)->start() == sample_start());
    EXPECT_TRUE((*reader)->asset());
    const std::vector<std::string> read = read_all(**reader);
    EXPECT_GE(read.size(), all.size());
    EXPECT_TRUE(std::equal(all.rbegin(), all.rend(), read.rbegin()));
    // A file that was not closed has them once.
    bytes.resize(chunk_of(whole, 4).offset);
    EXPECT_FALSE(open_bytes(bytes));
  }
}

TEST(RecordingReader, BelievesTheIndexWhereTheHeadOfAChunkIsDamaged) {
  mcap::Bytes bytes = sample_recording();
  const std::vector<std::string> all = read_all(bytes);
  put_at(bytes, chunk_of(bytes, 3).offset + 2, uint8_t{0xFF});
  EXPECT_EQ(read_all(bytes), all);
}

TEST(RecordingCompare, NamesTheFirstStepThatDiffersAndHowFar) {
  const TemporaryFolder folder;
  const auto a = save(folder, "a.mcap", test::moving_recording(25));
  const auto shorter = save(folder, "b.mcap", test::moving_recording(15));
  const auto other = save(folder, "c.mcap", test::moving_recording(25, 3));
  const auto equal = compare_recordings(a, a);
  ASSERT_TRUE(equal) << equal.error().to_string();
  EXPECT_EQ(equal->equal_states, 25u);
  EXPECT_FALSE(equal->first_different_tick);
  EXPECT_EQ(equal->compared_frames, 25u);
  EXPECT_EQ(equal->max_distance_m, 0.0);
  const auto part = compare_recordings(a, shorter);
  ASSERT_TRUE(part);
  EXPECT_EQ(part->equal_states, 15u);
  EXPECT_FALSE(part->first_different_tick);
  const auto different = compare_recordings(a, other);
  ASSERT_TRUE(different);
  EXPECT_EQ(different->first_different_tick, uint64_t{0});
  // All vertices are three lattice steps along x from where they are in the other one.
  const double shift_m = 3.0 * static_cast<double>(*lattice_step_m("delta", 1e-4f));
  EXPECT_NEAR(different->max_distance_m, shift_m, 1e-6 * shift_m + 1e-7);
}

TEST(RecordFile, ReplacesNothingButARecordingAndThatWhenTold) {
  const TemporaryFolder folder;
  const mcap::Bytes old = sample_recording();
  const auto path = save(folder, "run.mcap", old);
  const auto refused = RecordFile::make(path, IfPresent::Refuse);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().to_string(), HasSubstr("--record-replace"));
  { const auto given_up = RecordFile::make(path, IfPresent::Replace); }
  EXPECT_EQ(std::filesystem::file_size(path), old.size())
      << "the server did not start, and the old file is gone";
  {
    const auto file = RecordFile::make(path, IfPresent::Replace);
    ASSERT_TRUE(file) << file.error().to_string();
    (*file)->keep();
    EXPECT_TRUE((*file)->take({std::byte{'n'}, std::byte{'e'}, std::byte{'w'}}, true));
    (*file)->finish();
    EXPECT_EQ((*file)->written_bytes(), 3u);
  }
  EXPECT_EQ(*load_text(path, 100), "new");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "run.mcap.part"));
  const auto other = folder.write("precious.txt", "precious");
  const auto kept = RecordFile::make(other, IfPresent::Replace);
  ASSERT_FALSE(kept);
  EXPECT_THAT(kept.error().to_string(), HasSubstr("only a recording is replaced"));
  EXPECT_EQ(*load_text(other, 100), "precious");
  EXPECT_TRUE(RecordFile::make(folder.write("empty.mcap", ""), IfPresent::Refuse)) << "nothing is in it";
  const auto nowhere = RecordFile::make(folder.path() / "no" / "folder.mcap", IfPresent::Refuse);
  ASSERT_FALSE(nowhere);
  EXPECT_THAT(nowhere.error().to_string(), HasSubstr("cannot be written"));
}

TEST(RecordFile, WaitsForNoPipeAndTakesNoDevice) {
  const TemporaryFolder folder;
  const auto pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::filesystem::path& path : {pipe, std::filesystem::path("/dev/full")})
    for (const IfPresent if_present : {IfPresent::Refuse, IfPresent::Replace}) {
      const auto refused = RecordFile::make(path, if_present);
      ASSERT_FALSE(refused);
      EXPECT_THAT(refused.error().to_string(), HasSubstr("not a regular file"));
    }
  // Nor does a reader: it would wait until somebody writes, whatever signal comes meanwhile.
  const auto source = open_byte_source(pipe);
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().to_string(), HasSubstr("not a regular file"));
}

TEST(RecordFile, IsWrittenByOneProgramOnly) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "run.mcap";
  const auto expect_locked = [&] {
    const auto second = RecordFile::make(path, IfPresent::Replace);
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().to_string(), HasSubstr("another program records into it"));
  };
  for (int i = 0; i < 2; ++i) {  // a new file, then one that replaces it
    const auto first = RecordFile::make(path, IfPresent::Replace);
    ASSERT_TRUE(first) << first.error().to_string();
    expect_locked();
    (*first)->keep();
    expect_locked();
    EXPECT_TRUE((*first)->take(sample_recording(), true));
    (*first)->finish();
    expect_locked();
  }
}

TEST(RecordFile, EndsWholeWhereTheDiskIsFull) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "run.mcap";
  const auto file = RecordFile::make(path, IfPresent::Refuse);
  ASSERT_TRUE(file) << file.error().to_string();
  (*file)->keep();
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{1000, before.rlim_max};
  const auto* const ignored = std::signal(SIGXFSZ, SIG_IGN) == SIG_ERR ? "" : nullptr;
  ASSERT_EQ(ignored, nullptr);
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_TRUE((*file)->take(mcap::Bytes(600), true));
  (*file)->take(mcap::Bytes(600), true);
  (*file)->finish();
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_DFL);
  ASSERT_TRUE((*file)->failure());
  EXPECT_FALSE((*file)->take(mcap::Bytes(1), true));
  EXPECT_EQ((*file)->written_bytes(), 600u);
  EXPECT_EQ(std::filesystem::file_size(path), 600u) << "half of what did not fit is in the file";
}

}  // namespace
}  // namespace strandcast::recording_test
