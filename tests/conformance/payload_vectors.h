// Kept assets and pictures of tiles. Lines:
//   asset HASH BYTES                       of its content in the order of proto/WIRE.md; the payload
//   tiles WIDTH HEIGHT R G B BYTES         a picture of one colour; the payload of all its tiles
#pragma once

#include <string>

#include "common/strands/asset/layout.h"
#include "tests/conformance/stored_stream.h"

namespace strandcast::conformance {

/// Of the arrays of an asset, one part each.
uint64_t content_hash(const SceneAsset& asset);

/// Today's, to be kept.
std::string make_asset_lines(AssetLayout layout);
std::string make_tile_lines();

}  // namespace strandcast::conformance
