// SPDX-License-Identifier: Apache-2.0
#include "offload/page/host_page.h"

#include "common/bundle/atomic_file.h"
#include "offload/page/landmark_view.h"
#include "offload/page/page_files.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

namespace {

using nlohmann::json;

constexpr std::chrono::milliseconds look_interval{400};
const std::string scan_pattern = "([0-9A-HJKMNP-TV-Z]{26})";

std::string type_of(const std::string& name) {
  static const std::map<std::string, std::string> types = {{".glb", "model/gltf-binary"},
                                                           {".vrm", "model/gltf-binary"},
                                                           {".fbx", "application/octet-stream"},
                                                           {".html", "text/html; charset=utf-8"},
                                                           {".json", "application/json"},
                                                           {".png", "image/png"},
                                                           {".jpg", "image/jpeg"}};
  const auto type = types.find(std::filesystem::path(name).extension().string());
  return type == types.end() ? "application/octet-stream" : type->second;
}

// A report brings its own script and styles, and may reach nothing outside itself.
constexpr const char* report_policy =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; frame-ancestors 'self'; "
    "sandbox allow-scripts";

// A keyframe at a quarter of its size or less, for lists.
HttpResponse small_picture(const std::filesystem::path& file) {
  HttpResponse response;
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_REDUCED_COLOR_4);
  std::vector<unsigned char> bytes;
  if (image.empty() || !cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 80})) {
    return error_response(404, "there is no such picture");
  }
  response.type = "image/jpeg";
  response.body.assign(bytes.begin(), bytes.end());
  return response;
}

Result<json> json_of(const HttpRequest& request) {
  json body = json::parse(request.body, nullptr, false);
  if (!body.is_object()) return wrong_use("the request is not a JSON object");
  return body;
}

}  // namespace

HostPage::HostPage(HostPageOptions options, Store& store, std::vector<Stage> stages, ScanActions actions)
    : options_(std::move(options)),
      store_(store),
      stages_(std::move(stages)),
      actions_(std::move(actions)),
      uploads_(store.folder() / "uploads", options_.reserve_bytes),
      importer_(store, uploads_, actions_.queued),
      server_(options_.http) {
  server_.serve(host_page_files());
  server_.stream("/api/events", EventStream::type, [this](const HttpRequest&) {
    return events_.watch([this] { return format_event("scans", rows().dump()); });
  });
  add_scan_routes();
  add_file_routes();
  add_upload_routes();
  add_landmark_routes();
}

HostPage::~HostPage() {
  stop();
}

Result<void> HostPage::start() {
  if (const Result<void> started = server_.start(); !started) return started;
  importer_.start();
  watcher_ = std::thread([this] { watch(); });
  return {};
}

void HostPage::stop() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  if (watcher_.joinable()) watcher_.join();
  server_.stop();
  importer_.stop();
}

void HostPage::watch() {
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, look_interval, [this] { return stopping_; })) {
    lock.unlock();
    if (events_.is_watched()) publish_changes();
    lock.lock();
  }
}

// The store is changed from many sides; looking at it is simpler than being told by all of them, and cannot miss one.
void HostPage::publish_changes() {
  const Result<std::vector<StoredScan>> scans = store_.scans();
  if (!scans) return;
  const Look seen = look();
  std::map<std::string, Told> now;
  for (const StoredScan& scan : *scans) {
    const auto before = told_.find(scan.id);
    const bool in_work =
        scan.phase == StorePhase::receiving || seen.work.contains(scan.id) || importer_.work(scan.id).has_value();
    // Files of a scan change while it is in work, and a last time when that ends; looking at them all always would not
    // do for a thousand scans.
    if (before != told_.end() && !in_work && !before->second.in_work && before->second.scan == scan) {
      now.insert(told_.extract(before));
      continue;
    }
    json row = row_of(scan, seen);
    if (before == told_.end() || before->second.row != row) events_.publish("scan", row.dump());
    now.emplace(scan.id, Told{scan, std::move(row), in_work});
  }
  for (const auto& [id, told] : told_) {
    if (!now.contains(id)) events_.publish("deleted", json{{"id", id}}.dump());
  }
  told_ = std::move(now);
}

Result<StoredScan> HostPage::find(const std::string& id) const {
  const Result<std::optional<StoredScan>> scan = store_.scan(id);
  if (!scan) return tl::unexpected(scan.error());
  if (!*scan) return wrong_use("there is no such scan", id);
  return **scan;
}

HostPage::Look HostPage::look() const {
  Look look{actions_.work(), {}};
  for (DeviceView& device : actions_.devices()) look.devices[device.key] = std::move(device);
  return look;
}

json HostPage::row_of(const StoredScan& scan, const Look& look) const {
  const auto device = look.devices.find(scan.device_key);
  const std::optional<DeviceView> from = device == look.devices.end() ? std::nullopt : std::optional(device->second);
  const std::optional<ScanActivity> importing = importer_.work(scan.id);
  if (importing) return scan_row(store_, scan, importing, true, from);
  const auto found = look.work.find(scan.id);
  return scan_row(store_, scan, found == look.work.end() ? std::nullopt : std::optional(found->second), false, from);
}

json HostPage::rows() const {
  json rows = json::array();
  const Result<std::vector<StoredScan>> scans = store_.scans();
  if (!scans) return rows;
  const Look seen = look();
  for (const StoredScan& scan : *scans) rows.push_back(row_of(scan, seen));
  return rows;
}

HttpResponse HostPage::answer(const Result<void>& done) const {
  return done ? json_response(json::object()) : error_response(done.error());
}

void HostPage::add_scan_routes() {
  const std::string scan = "/api/scans/" + scan_pattern;
  server_.get("/api/devices", [this](const HttpRequest&) {
    json devices = json::array();
    for (const DeviceView& device : actions_.devices()) devices.push_back(device_row(device));
    return json_response(devices);
  });
  server_.get("/api/scans", [this](const HttpRequest&) { return json_response(rows()); });
  server_.get(scan, [this](const HttpRequest& request) {
    const Result<StoredScan> found = find(request.parts[0]);
    if (!found) return error_response(404, found.error().message());
    return json_response(scan_details(store_, row_of(*found, look()), found->id, stages_));
  });
  server_.post(scan + "/cancel",
               [this](const HttpRequest& request) { return answer(actions_.cancel(request.parts[0])); });
  server_.post(scan + "/rerun", [this](const HttpRequest& request) {
    const Result<json> body = json_of(request);
    if (!body) return error_response(body.error());
    const json options = body->value("options", json::object());
    if (const Result<void> valid = check_page_options(options, stages_); !valid) return error_response(valid.error());
    return answer(actions_.rerun(request.parts[0], options));
  });
  server_.remove(scan, [this](const HttpRequest& request) {
    if (const Result<StoredScan> found = find(request.parts[0]); !found) {
      return error_response(404, found.error().message());
    }
    importer_.drop(request.parts[0]);
    return answer(actions_.remove(request.parts[0]));
  });
}

void HostPage::add_file_routes() {
  const std::string scan = "/scans/" + scan_pattern;
  // Only names that are known, so that no path leads anywhere else.
  server_.get(scan + "/(avatar(?:-50|-25)?\\.glb|avatar\\.(?:vrm|fbx)|report\\.(?:html|json))",
              [this](const HttpRequest& request) {
                if (!find(request.parts[0])) return error_response(404, "there is no such scan");
                const std::string& name = request.parts[1];
                HttpResponse response;
                response.type = type_of(name);
                response.file = result_file(store_.bundle(request.parts[0]), name);
                if (name == "report.html") response.headers["Content-Security-Policy"] = report_policy;
                if (request.query.contains("download")) {
                  response.headers["Content-Disposition"] =
                      "attachment; filename=\"" + request.parts[0] + "-" + name + "\"";
                }
                return response;
              });
  server_.get(scan + "/frames/([a-z]{1,16}-[0-9]{6}\\.jpg)", [this](const HttpRequest& request) {
    if (!find(request.parts[0])) return error_response(404, "there is no such scan");
    const std::filesystem::path file = store_.bundle(request.parts[0]).frames() / request.parts[1];
    HttpResponse response;
    if (request.query.contains("small")) {
      response = small_picture(file);
    } else {
      response.type = "image/jpeg";
      response.file = file;
    }
    // A keyframe never changes once it is there.
    if (response.status == 200) response.headers["Cache-Control"] = "private, max-age=86400";
    return response;
  });
  server_.get(scan + "/texture/(source|confidence)\\.png", [this](const HttpRequest& request) {
    if (!find(request.parts[0])) return error_response(404, "there is no such scan");
    HttpResponse response;
    response.type = "image/png";
    response.file = store_.bundle(request.parts[0]).work("texture") / (request.parts[1] + ".png");
    return response;
  });
}

void HostPage::add_upload_routes() {
  const std::string upload = "/api/uploads/" + scan_pattern;
  server_.post("/api/uploads", [this](const HttpRequest& request) {
    const Result<json> body = json_of(request);
    if (!body) return error_response(body.error());
    const json bytes = body->value("bytes", json());
    if (!bytes.is_number_unsigned()) return error_response(400, "say how many bytes will be sent");
    if (bytes.get<std::uint64_t>() > options_.http.max_upload_bytes) {
      return error_response(413, "the recording is too large");
    }
    const Result<std::string> id = uploads_.begin(bytes.get<std::uint64_t>());
    if (!id) return error_response(507, id.error().message());
    return json_response({{"upload", *id}}, 201);
  });
  server_.upload(upload + "/(body|head|turn)", [this](const HttpRequest& request, const HttpServer::Reader& read) {
    const auto kind = request.query.find("kind");
    return answer(
        uploads_.take(request.parts[0], request.parts[1], kind == request.query.end() ? "mp4" : kind->second, read));
  });
  server_.post(upload + "/finish", [this](const HttpRequest& request) {
    const Result<json> body = json_of(request);
    if (!body) return error_response(body.error());
    std::optional<double> height;
    if (const json given = body->value("height_mm", json()); given.is_number()) {
      height = given.get<double>();
      if (!(*height >= 300.0 && *height <= 2600.0)) return error_response(400, "a stature is 300 to 2600 mm");
    }
    const std::string& id = request.parts[0];
    if (const Result<void> finished = uploads_.finish(id, height); !finished) return error_response(finished.error());
    if (const Result<void> added = importer_.add(id); !added) return error_response(added.error());
    return json_response({{"scan", id}}, 201);
  });
  server_.remove(upload, [this](const HttpRequest& request) {
    // A finished one is a scan, and deleted as such.
    if (find(request.parts[0])) return error_response(409, "the upload is a scan already");
    uploads_.remove(request.parts[0]);
    return json_response(json::object());
  });
}

void HostPage::add_landmark_routes() {
  const std::string path = "/api/scans/" + scan_pattern + "/landmarks";
  server_.get(path, [this](const HttpRequest& request) {
    if (!find(request.parts[0])) return error_response(404, "there is no such scan");
    return json_response(landmark_view(store_.bundle(request.parts[0])));
  });
  server_.put(path, [this](const HttpRequest& request) {
    const Result<StoredScan> found = find(request.parts[0]);
    if (!found) return error_response(404, found.error().message());
    const Result<json> body = json_of(request);
    if (!body) return error_response(body.error());
    if (const Result<void> kept = keep_picked(store_.bundle(found->id), *body); !kept) {
      return error_response(kept.error());
    }
    return answer(actions_.rerun(found->id, json::object()));
  });
}

}  // namespace gyre
