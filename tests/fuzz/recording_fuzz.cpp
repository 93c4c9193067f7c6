// libFuzzer entry: a file that is opened as a recording. All of it can be read, from any moment on, and
// looked at; what was read once reads the same again.
#include "common/base/check.h"
#include "common/record/recording_check.h"
#include "common/record/recording_reader.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::recording_fuzz {
namespace {

/// Items and errors up to the end, which comes: every call goes on.
size_t count_items(RecordingReader& reader, size_t size) {
  size_t count = 0;
  while (true) {
    const auto item = reader.next();
    if (item && !*item) return count;
    ++count;
    // A message takes more bytes than this in a file, but for what zstd makes of many that are alike.
    constexpr size_t kMostPerByte = 1u << 16;
    CHECK(count <= (size + 1) * kMostPerByte);
  }
}

}  // namespace

extern "C" int FUZZ_ENTRY(recording)(const uint8_t* data, size_t size) {
  const auto bytes = FuzzInput(data, size).take_rest();
  const std::vector<std::byte> file(bytes.begin(), bytes.end());
  const auto reader = RecordingReader::open(memory_byte_source(file));
  if (!reader) return 0;
  const size_t count = count_items(**reader, size);
  CHECK((*reader)->seek((*reader)->info().first_sim_time_ns).ok());
  const size_t again = count_items(**reader, size);
  CHECK(again <= count);
  CHECK((*reader)->seek((*reader)->info().last_sim_time_ns).ok());
  count_items(**reader, size);
  const auto source = memory_byte_source(file);
  const auto check = check_recording(*source);
  if (check) CHECK(check->decoded_frames <= check->frames);
  return 0;
}

}  // namespace strandcast::recording_fuzz
