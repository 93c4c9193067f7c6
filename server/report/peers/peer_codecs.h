// The general codecs that strands are compared with: which there are in this build, and as rows of the
// report. Only strandcast-report links them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/report/peers/lattice_peer.h"

namespace strandcast {

/// All peers of this build whose result depends on the bound, each on plain positions and on residuals of a
/// prediction in time.
std::vector<StreamCodecRow> peer_stream_codecs(double bound_m);
/// zstd on floats, and on 16-bit integers over a fixed box, plain and predicted.
std::vector<StreamCodecRow> bound_free_stream_codecs();
/// One sentence for each peer whose library was not there when this program was built.
std::vector<std::string> missing_peers();

std::unique_ptr<StreamCodec> make_float_peer(const StreamShape& shape);
/// zfp in accuracy mode, one array of strands by vertices per axis; the tolerance is the largest power of two
/// that keeps the bound in every frame so far, which is found outside the measured time.
std::unique_ptr<StreamCodec> make_zfp_peer(double bound_m, PeerPrediction prediction,
                                           const StreamShape& shape);

}  // namespace strandcast
