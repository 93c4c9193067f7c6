#include "server/report/peers/peer_codecs.h"

#include <numbers>

#include "common/strands/snapshot.h"

namespace strandcast {
namespace {

// 16 bits over a metre, the head joint in the middle: what hair needs.
constexpr double kBoxM = 1.0;
constexpr double kBoxStepM = kBoxM / 65536.0;

using MakePeer = std::function<std::unique_ptr<StreamCodec>(PeerPrediction, const StreamShape&)>;

/// The peer on plain positions and with a prediction in time.
void add_both(std::vector<StreamCodecRow>& rows, const StreamCodecRow& row, const MakePeer& make) {
  for (const PeerPrediction prediction : {PeerPrediction::None, PeerPrediction::Temporal}) {
    StreamCodecRow both = row;
    both.is_temporal = prediction == PeerPrediction::Temporal;
    if (both.is_temporal) both.name += " temporal";
    both.make = [make, prediction](const StreamShape& shape) -> Result<std::unique_ptr<StreamCodec>> {
      return make(prediction, shape);
    };
    rows.push_back(std::move(both));
  }
}

MakePeer on_lattice(double quantum_m, std::unique_ptr<IntegerCoder> (*make_coder)()) {
  return [=](PeerPrediction prediction, const StreamShape& shape) {
    return make_lattice_peer({static_cast<float>(quantum_m), prediction, make_coder}, shape);
  };
}

}  // namespace

std::vector<StreamCodecRow> peer_stream_codecs(double bound_m) {
  std::vector<StreamCodecRow> rows;
  StreamCodecRow row;
  row.bound_m = bound_m;
  [[maybe_unused]] const double quantum_m = quantum_for_bound(static_cast<float>(bound_m));
#ifdef STRANDCAST_HAS_MESHOPT
  row.name = "meshopt+zstd";
  add_both(rows, row, on_lattice(quantum_m, make_meshopt_coder));
#endif
#ifdef STRANDCAST_HAS_DRACO
  row.name = "draco";
  add_both(rows, row, on_lattice(quantum_m, make_draco_coder));
#endif
#ifdef STRANDCAST_HAS_ZFP
  row.name = "zfp";
  add_both(rows, row, [bound_m](PeerPrediction prediction, const StreamShape& shape) {
    return make_zfp_peer(bound_m, prediction, shape);
  });
#endif
  return rows;
}

std::vector<StreamCodecRow> bound_free_stream_codecs() {
  std::vector<StreamCodecRow> rows;
  StreamCodecRow row;
  row.is_bound_free = true;
  row.name = "zstd float";
  row.make = [](const StreamShape& shape) -> Result<std::unique_ptr<StreamCodec>> {
    return make_float_peer(shape);
  };
  rows.push_back(row);
  row.name = "zstd 16 bit";
  row.bound_m = 0.5 * kBoxStepM * std::numbers::sqrt3;
  add_both(rows, row, on_lattice(kBoxStepM, make_zstd_coder));
  return rows;
}

std::vector<std::string> missing_peers() {
  std::vector<std::string> sentences;
#ifndef STRANDCAST_HAS_MESHOPT
  sentences.emplace_back("meshoptimizer takes no part: libmeshoptimizer-dev was not installed at the build.");
#endif
#ifndef STRANDCAST_HAS_DRACO
  sentences.emplace_back("Draco takes no part: libdraco-dev was not installed at the build.");
#endif
#ifndef STRANDCAST_HAS_ZFP
  sentences.emplace_back("zfp takes no part: libzfp-dev was not installed at the build.");
#endif
  return sentences;
}

}  // namespace strandcast
