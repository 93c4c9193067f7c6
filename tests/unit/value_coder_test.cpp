#include "common/strands/value_coder.h"

#include <cmath>
#include <random>

namespace strandcast::value_coder_test {
namespace {

SymbolTable even_table() {
  SymbolTable table;
  for (uint32_t k = 0; k < kSymbolCount; ++k)
    table.start[k] = static_cast<int16_t>(k * (kProbabilityOne / kSymbolCount));
  return table;
}

bool is_rising(const SymbolTable& table) {
  bool rises = table.start[0] == 0;
  for (uint32_t k = 0; k < kSymbolCount; ++k) rises &= table.share(k) > 0;
  return rises;
}

TEST(ValueCoder, FoldingIsOneToOneAndPutsSmallValuesFirst) {
  for (uint32_t folded = 0; folded < 100; ++folded) {
    EXPECT_EQ(fold_sign(unfold_sign(folded)), folded);
    EXPECT_EQ(std::abs(unfold_sign(folded)), static_cast<int32_t>((folded + 1) / 2));
  }
  for (const int32_t value : {INT32_MIN, INT32_MIN + 1, INT32_MAX, INT32_MAX - 1})
    EXPECT_EQ(unfold_sign(fold_sign(value)), value);
}

TEST(ValueCoder, TablesStayStrictlyRisingWhateverTheyLearn) {
  SymbolTable table = even_table();
  for (uint32_t symbol = 0; symbol < kSymbolCount; ++symbol) {
    for (int i = 0; i < 5000; ++i) table.learn(symbol);
    EXPECT_TRUE(is_rising(table));
    EXPECT_GT(table.share(symbol), kProbabilityOne * 95 / 100);
  }
  std::mt19937 random(3);
  for (int i = 0; i < 100'000; ++i) {
    table.learn(random() % kSymbolCount);
    ASSERT_TRUE(is_rising(table));
  }
}

TEST(ValueCoder, EveryPlaceBelongsToTheSymbolWhoseShareCoversIt) {
  SymbolTable table = even_table();
  for (int i = 0; i < 300; ++i) table.learn(i % 3 == 0 ? 7 : 2);
  for (int32_t place = 0; place < kProbabilityOne; ++place) {
    const uint32_t symbol = find_symbol(table, place);
    ASSERT_LT(symbol, kSymbolCount);
    ASSERT_LE(table.start[symbol], place);
    ASSERT_LT(place, table.start[symbol] + table.share(symbol));
  }
}

TEST(ValueCoder, ReadsBackValuesOfEverySizeAndShift) {
  std::mt19937 random(9);
  std::vector<uint32_t> values;
  std::vector<uint32_t> shifts;
  for (int i = 0; i < 20'000; ++i) {
    values.push_back(static_cast<uint32_t>(random()) >> (random() % 32));
    shifts.push_back(random() % 6);
  }
  for (const uint32_t edge : {0u, 11u, 12u, 13u, 14u, 17u, 18u, 33u, 34u, 35u, UINT32_MAX - 1, UINT32_MAX}) {
    values.push_back(edge);
    shifts.push_back(0);
  }
  ValueWriter writer;
  std::vector<std::byte> bytes;
  for (int round = 0; round < 2; ++round) {  // the second time shows that finish() starts anew
    SymbolTable table = even_table();
    bytes.clear();
    for (size_t i = 0; i < values.size(); ++i) {
      writer.put(values[i], table, shifts[i]);
      if (i % 3 == 0) writer.put_bits(values[i] & 0x3ffffu, 18);
    }
    writer.finish(bytes);
    bytes.push_back(std::byte{42});  // belongs to somebody else
    ValueReader reader;
    const auto rest = reader.open(bytes);
    ASSERT_TRUE(rest) << rest.error().to_string();
    EXPECT_EQ(rest->size(), 1u);
    SymbolTable read_table = even_table();
    for (size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(reader.take(read_table, shifts[i]), values[i]) << i;
      if (i % 3 == 0) {
        ASSERT_EQ(reader.take_bits(18), values[i] & 0x3ffffu);
      }
    }
    EXPECT_TRUE(reader.is_spent());
    EXPECT_EQ(read_table, table);
  }
}

// Symbols that are mostly 0, many at a time and with a guess that they are.
TEST(ValueCoder, TakesManySymbolsAsItTakesOne) {
  constexpr size_t kRun = 1000;
  std::mt19937 random(5);
  std::vector<uint32_t> values;
  for (size_t i = 0; i < 20 * kRun; ++i)
    values.push_back(random() % 16 == 0 ? random() >> (random() % 32) : 0);
  ValueWriter one;
  ValueWriter many;
  SymbolTable table = even_table();
  SymbolTable same_table = even_table();
  for (size_t i = 0; i < values.size(); i += kRun) {
    SymbolStep* next = many.begin_run(kRun);
    for (size_t k = i; k < i + kRun; ++k) {
      one.put(values[k], table, 0);
      many.put(values[k], same_table, 0, next);
    }
    many.end_run(next);
  }
  std::vector<std::byte> bytes;
  std::vector<std::byte> same_bytes;
  one.finish(bytes);
  many.finish(same_bytes);
  EXPECT_TRUE(same_bytes == bytes);
  ValueReader reader;
  ASSERT_TRUE(reader.open(bytes));
  SymbolTable read_table = even_table();
  for (size_t i = 0; i < values.size(); i += kRun) {
    SymbolCursor cursor = reader.begin_run(kRun);
    for (size_t k = i; k < i + kRun; ++k) {
      const uint32_t symbol = cursor.take_zero(read_table) ? 0 : cursor.take(read_table);
      ASSERT_EQ(reader.value_of(symbol, 0), values[k]) << k;
    }
    reader.end_run(cursor);
  }
  EXPECT_TRUE(reader.is_spent());
  EXPECT_EQ(read_table, table);
}

// Any number of slices of any length, packed side by side, are what each is alone.
TEST(ValueCoder, PacksManySlicesAsItPacksOne) {
  std::mt19937 random(7);
  for (const size_t count : {1u, 3u, 4u, 6u, 9u}) {
    std::vector<ValueWriter> writers(count);
    std::vector<std::vector<std::byte>> alone(count);
    std::vector<std::vector<std::byte>> together(count);
    for (int round = 0; round < 2; ++round) {
      for (size_t i = 0; i < count; ++i) {
        ValueWriter single;
        SymbolTable table = even_table();
        SymbolTable same_table = even_table();
        for (size_t k = random() % 500; k > 0; --k) {
          const uint32_t value = random() >> (random() % 32);
          single.put(value, table, 1);
          writers[i].put(value, same_table, 1);
        }
        single.finish(alone[i]);
      }
      ValueWriter::finish_all(writers, together);
    }
    EXPECT_TRUE(together == alone);
  }
}

TEST(ValueCoder, CostsLittleMoreThanTheEntropyOfItsSource) {
  // Geometric with ratio r has -log2(1 - r) - r / (1 - r) log2(r) bits of entropy.
  constexpr double kRatio = 0.5;
  constexpr size_t kCount = 50'000;
  const double entropy_bits = -std::log2(1.0 - kRatio) - kRatio / (1.0 - kRatio) * std::log2(kRatio);
  std::mt19937 random(1);
  std::geometric_distribution<uint32_t> source(1.0 - kRatio);
  SymbolTable table = even_table();
  ValueWriter writer;
  for (size_t i = 0; i < kCount; ++i) writer.put(source(random), table, 0);
  std::vector<std::byte> bytes;
  writer.finish(bytes);
  EXPECT_LT(8.0 * static_cast<double>(bytes.size()) / kCount, 1.03 * entropy_bits);
}

TEST(ValueCoder, MissingOrLeftOverBytesAreNoticed) {
  SymbolTable table = even_table();
  ValueWriter writer;
  for (uint32_t i = 0; i < 100; ++i) writer.put(i, table, 0);
  std::vector<std::byte> bytes;
  writer.finish(bytes);
  const auto is_spent_after = [&](int count) {
    ValueReader reader;
    EXPECT_TRUE(reader.open(bytes));
    SymbolTable read_table = even_table();
    for (int i = 0; i < count; ++i) reader.take(read_table, 0);
    return reader.is_spent();
  };
  EXPECT_TRUE(is_spent_after(100));
  EXPECT_FALSE(is_spent_after(99));
  EXPECT_FALSE(is_spent_after(101));
  EXPECT_FALSE(is_spent_after(1000));
  for (size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(ValueReader().open(std::span(bytes).first(size))) << size;
}

}  // namespace
}  // namespace strandcast::value_coder_test
