// SPDX-License-Identifier: Apache-2.0
#include "tests/common/wire/sample_messages.h"

namespace gyre::wire {

std::vector<Message> sample_messages() {
  const std::string scan = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
  const std::string hash(64, '7');
  const std::string public_key = "rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7";  // of ZeroMQ's RFC 26
  const FileEntry picture{"frames/body-000012.jpg", 1000, hash};
  const FileEntry avatar{"avatar.glb", 5, hash};
  return {
      Hello{1, 3, "rig in the cellar", {"status", "what comes later"}, 20'000},
      Welcome{1, 0, {"status", "coverage"}, 60'000},
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
      PairRequest{"rig-1", public_key, std::string(pair_session_bytes, '\xff'), std::string(32, '\x01')},
      PairAnswer{public_key, std::string(32, '\0')},
      PairProof{std::string(64, '\x80')},
      PairDone{std::string(64, '\x7f')},
      DeviceStatus{"recording", "walk on to the left", scan, 1ULL << 36, 2, 117},
      DeviceStatus{"ready", "", "", 0, 0, 0},
      CoveragePreview{scan, "body", {{"body upper", 0.75, std::string("\0\xff\x80", 3)}, {"body lower", 0, ""}}},
  };
}

}  // namespace gyre::wire
