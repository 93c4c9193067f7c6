// libFuzzer entry: the rANS coder of strand values. The same bytes are taken as a hostile slice to read, and
// as values to write and read back.
#include "common/base/check.h"
#include "common/strands/value_coder.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::value_coder_fuzz {
namespace {

constexpr uint32_t kTables = 3;
constexpr uint32_t kMostShift = 20;

std::array<SymbolTable, kTables> even_tables() {
  std::array<SymbolTable, kTables> tables;
  for (SymbolTable& table : tables)
    for (uint32_t k = 0; k < kSymbolCount; ++k)
      table.start[k] = static_cast<int16_t>(k * (kProbabilityOne / static_cast<int32_t>(kSymbolCount)));
  return tables;
}

void read_hostile(FuzzInput input) {
  const size_t count = input.take<uint8_t>();
  const auto source = input.take_rest();
  ValueReader reader;
  const auto rest = reader.open(source);
  if (!rest) return;
  CHECK(rest->size() <= source.size());
  auto tables = even_tables();
  for (size_t i = 0; i < count; ++i) {
    (void)reader.take(tables[i % kTables], static_cast<uint32_t>(i) % (kMostShift + 1));
    for (uint32_t k = 0; k < kSymbolCount; ++k) CHECK(tables[i % kTables].share(k) > 0);
  }
  CHECK(!(reader.is_spent() && reader.is_short()));
}

void write_and_read(FuzzInput input) {
  struct Value {
    uint32_t folded;
    uint32_t shift;
  };
  std::vector<Value> values;
  while (!input.is_empty()) {
    const uint32_t shift = input.take<uint8_t>() % (kMostShift + 1);
    const auto value = input.take<int32_t>();
    CHECK(unfold_sign(fold_sign(value)) == value);
    values.push_back({fold_sign(value), shift});
  }
  ValueWriter writer;
  auto tables = even_tables();
  for (size_t i = 0; i < values.size(); ++i)
    writer.put(values[i].folded, tables[i % kTables], values[i].shift);
  std::vector<std::byte> bytes;
  writer.finish(bytes);
  ValueReader reader;
  const auto rest = reader.open(bytes);
  CHECK(rest.ok() && rest->empty());
  tables = even_tables();
  for (size_t i = 0; i < values.size(); ++i)
    CHECK(reader.take(tables[i % kTables], values[i].shift) == values[i].folded);
  CHECK(reader.is_spent() && !reader.is_short());
}

}  // namespace

extern "C" int FUZZ_ENTRY(value_coder)(const uint8_t* data, size_t size) {
  read_hostile(FuzzInput(data, size));
  write_and_read(FuzzInput(data, size));
  return 0;
}

}  // namespace strandcast::value_coder_fuzz
