// SPDX-License-Identifier: Apache-2.0
#include "tests/common/wire/sample_messages.h"

namespace gyre::wire {

std::vector<Message> sample_messages() {
  const std::string scan = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
  const std::string hash(64, '7');
  const FileEntry picture{"frames/body-000012.jpg", 1000, hash};
  const FileEntry avatar{"avatar.glb", 5, hash};
  return {
      Hello{1, 3, "rig in the cellar"},
      Welcome{1, 0},
      Refused{"for a reason", true},
      Ping{},
      Pong{},
      Credit{1ULL << 40},
      ScanOpen{scan, "{\"id\": 1}"},
      ScanState{scan, ScanPhase::receiving, "", {{picture, 500, false}, {{"scan.json", 10, hash}, 10, true}}},
      ScanState{scan, ScanPhase::failed, "no features", {}},
      FileChunk{scan, picture, 900, std::string(100, '\xff')},
      FileChunk{scan, {"frames.jsonl", 0, hash}, 0, ""},
      FileAck{scan, picture.name, hash},
      FileResume{scan, picture.name, hash, 77},
      Discard{scan, picture.name},
      ScanClose{scan, {picture, {"scan.json", 10, hash}}},
      StageProgress{scan, "cloud", 0.25, "depth of view 3 of 12"},
      ResultOffer{scan, {avatar}},
      ResultRequest{scan, avatar.name, hash, 4},
      ResultChunk{scan, avatar.name, hash, 4, std::string("\0", 1)},
      ResultAck{scan},
  };
}

}  // namespace gyre::wire
