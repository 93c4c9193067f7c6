// A Hello inside the HTTP request for the WebSocket, which saves a round trip (proto/WIRE.md).
#pragma once

#include <cstddef>

namespace strandcast {

/// Field of the request with the bytes of the Hello message in base64; of the answer where it was taken.
inline constexpr const char* kHelloField = "Strandcast-Hello";
inline constexpr const char* kHelloTaken = "taken";
/// Longest field that clients send; longer ones would not fit into a request's header.
inline constexpr size_t kMaxHelloFieldBytes = 4'096;

}  // namespace strandcast
