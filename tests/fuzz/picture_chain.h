// Input of the picture_chain fuzzer: a server that may be hostile sends pictures of several chains, one for
// each codec and size, with damaged, lost and made-up messages between the honest ones.
#pragma once

#include <cstdint>

namespace strandcast {

// Steps of a byte for the kind, a byte of flags and, but for Honest, Lost and Other, a piece (u16 length and
// bytes).
enum class PictureChainStep : uint8_t {
  Honest,   // the chain's next picture, or a whole one when the decoder has left the chain
  Lost,     // the chain's next picture never arrives, the one after it does
  Other,    // the flags are the number of the chain that goes on from here
  Whole,    // the piece is the message
  Payload,  // the piece, behind a valid header
  Patched,  // the next honest message, changed: the piece is u16 offset and a byte to XOR, repeated
  Spliced,  // the next honest message up to a u16 offset, and the rest of the piece behind it
};
inline constexpr int kPictureStepKinds = 7;

inline constexpr uint8_t kAsWhole = 1;     // flags: the valid header has base 0, else the last picture
inline constexpr uint8_t kFixPayload = 2;  // payload_bytes is corrected to what the message carries
inline constexpr uint8_t kThenDelta = 4;   // after a refusal the next honest change is tried, and must fail
inline constexpr int kOpcodeShift = 4;     // from here on: opcode of the valid header, counted from JpegFrame

inline constexpr int kPictureSizes = 3;  // chain = codec * kPictureSizes + size; H.264 where the build has it

}  // namespace strandcast
