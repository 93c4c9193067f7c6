// Sends strands to itself by every codec of an installed strand core. Prints the core's version.
#include <cstdio>

#include "all_headers.h"

using namespace strandcast;

/// Whether what is decoded is what was encoded.
bool survives(const std::string& codec) {
  constexpr float kBoundM = 1e-4f;
  const auto quantum_m = lattice_step_m(codec, kBoundM);
  const auto encoder = make_strand_encoder(codec);
  const auto decoder = make_strand_decoder(codec, {2, 3});
  if (!quantum_m || !encoder || !decoder) return false;
  Snapshot state;
  state.strand_count = 2;
  state.vertex_count = 3;
  state.quantum_m = *quantum_m;
  for (int32_t i = 0; i < 18; ++i) state.lattice.push_back(100'000 * i);
  const EncodedFramePtr frame = (*encoder)->encode(state);
  const auto decoded = (*decoder)->decode(frame->message);
  if (!decoded) return false;
  const auto sent = positions_in_head(state), received = positions_in_head(**decoded);
  bool is_same = sent.size() == 6 && received.size() == 6;
  for (size_t i = 0; is_same && i < sent.size(); ++i)
    is_same = glm::distance(sent[i], received[i]) <= kBoundM;
  return is_same;
}

int main() {
  for (const StrandCodecInfo& codec : strand_codecs()) {
    if (survives(codec.name)) continue;
    std::fprintf(stderr, "strands do not survive the codec %s\n", codec.name.c_str());
    return 1;
  }
  std::printf("%s\n", version());
  return 0;
}
