// Parsing of untrusted protobuf with limits. Private to common/wire.
#pragma once

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/stubs/logging.h>

#include <cstddef>
#include <span>

namespace strandcast {

inline constexpr int kMaxMessageNesting = 16;

/// Parses exactly one message. Returns false otherwise; then the content of `message` is undefined.
inline bool parse_message(std::span<const std::byte> bytes, google::protobuf::Message& message) {
  namespace io = google::protobuf::io;
  // Hostile bytes must not fill the log: protobuf would print a line for each.
  [[maybe_unused]] static auto* const previous_handler = google::protobuf::SetLogHandler(nullptr);
  io::ArrayInputStream array(bytes.data(), static_cast<int>(bytes.size()));
  io::CodedInputStream stream(&array);
  stream.SetRecursionLimit(kMaxMessageNesting);
  stream.SetTotalBytesLimit(static_cast<int>(bytes.size()));
  return message.ParseFromCodedStream(&stream) && stream.ConsumedEntireMessage();
}

}  // namespace strandcast
