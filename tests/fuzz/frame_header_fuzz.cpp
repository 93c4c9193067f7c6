// libFuzzer entry: the header of a media message.
#include <algorithm>

#include "common/base/check.h"
#include "common/strands/frame_header.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::frame_header_fuzz {

extern "C" int FUZZ_ENTRY(frame_header)(const uint8_t* data, size_t size) {
  const auto message = FuzzInput(data, size).take_rest();
  const auto header = unpack_frame_header(message);
  if (!header) return 0;
  CHECK(header->payload_bytes == size - kFrameHeaderBytes);
  const auto packed = pack(*header);
  CHECK(std::equal(packed.begin(), packed.end(), message.begin()));
  const EncodedFramePtr frame = make_encoded_frame(*header, message.subspan(kFrameHeaderBytes));
  CHECK(frame != nullptr && std::equal(message.begin(), message.end(), frame->message.begin()));
  const EncodedFramePtr stamped = with_send_time(*frame, 7, 9);
  const auto restamped = unpack_frame_header(stamped->message);
  CHECK(restamped.ok() && restamped->stream_id == 7 && restamped->send_time_ns == 9);
  return 0;
}

}  // namespace strandcast::frame_header_fuzz
