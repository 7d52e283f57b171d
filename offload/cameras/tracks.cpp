// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/tracks.h"

namespace gyre {

namespace {

// Union-find over keypoints whose sets know the views they touch (sorted).
class ExclusiveSets {
 public:
  explicit ExclusiveSets(std::size_t count) : parent_(count), views_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  void set_view(std::size_t element, int view) { views_[element] = {view}; }

  std::size_t find(std::size_t element) {
    while (parent_[element] != element) {
      parent_[element] = parent_[parent_[element]];
      element = parent_[element];
    }
    return element;
  }

  void join_unless_shared_view(std::size_t a, std::size_t b) {
    a = find(a);
    b = find(b);
    if (a == b) return;
    std::vector<int> both;
    std::merge(views_[a].begin(), views_[a].end(), views_[b].begin(), views_[b].end(), std::back_inserter(both));
    if (std::adjacent_find(both.begin(), both.end()) != both.end()) return;
    if (views_[a].size() < views_[b].size()) std::swap(a, b);
    parent_[b] = a;
    views_[a] = std::move(both);
    views_[b] = {};
  }

 private:
  std::vector<std::size_t> parent_;
  std::vector<std::vector<int>> views_;
};

}  // namespace

void build_tracks(Scene& scene, std::span<const ViewPair> pairs) {
  std::vector<std::size_t> first_of_view{0};
  for (const View& view : scene.views) first_of_view.push_back(first_of_view.back() + view.keypoints.size());
  ExclusiveSets sets(first_of_view.back());
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    for (std::size_t k = first_of_view[v]; k < first_of_view[v + 1]; ++k) sets.set_view(k, static_cast<int>(v));

  std::vector<const ViewPair*> strongest_first;
  for (const ViewPair& pair : pairs) strongest_first.push_back(&pair);
  std::stable_sort(strongest_first.begin(), strongest_first.end(),
                   [](const ViewPair* x, const ViewPair* y) { return x->matches.size() > y->matches.size(); });
  std::vector<bool> matched(first_of_view.back());
  for (const ViewPair* pair : strongest_first) {
    for (const Match& m : pair->matches) {
      const std::size_t a = first_of_view[static_cast<std::size_t>(pair->a)] + static_cast<std::size_t>(m.a);
      const std::size_t b = first_of_view[static_cast<std::size_t>(pair->b)] + static_cast<std::size_t>(m.b);
      matched[a] = matched[b] = true;
      sets.join_unless_shared_view(a, b);
    }
  }

  scene.tracks.clear();
  std::vector<int> track_of_root(first_of_view.back(), -1);
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    View& view = scene.views[v];
    view.track_of.assign(view.keypoints.size(), -1);
    for (std::size_t k = 0; k < view.keypoints.size(); ++k) {
      if (!matched[first_of_view[v] + k]) continue;
      int& track = track_of_root[sets.find(first_of_view[v] + k)];
      if (track < 0) {
        track = static_cast<int>(scene.tracks.size());
        scene.tracks.emplace_back();
      }
      view.track_of[k] = track;
      scene.tracks[static_cast<std::size_t>(track)].observations.push_back(
          {static_cast<int>(v), static_cast<int>(k), false});
    }
  }
}

}  // namespace gyre
