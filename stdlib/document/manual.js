// Search in the index that stands in index.js: all words must occur; names come first. No server is asked.
(function () {
  "use strict";
  var input = document.getElementById("words"), found = document.getElementById("found");

  function score(entry, words) {
    var title = entry[0].toLowerCase(), all = title + " " + entry[1].toLowerCase(), sum = 0;
    for (var i = 0; i < words.length; i++) {
      if (all.indexOf(words[i]) < 0) return 0;
      var last = title.split(/[.:#]/).pop();
      sum += title === words[i] || last === words[i] ? 8 : last.indexOf(words[i]) === 0 ? 4 :
        title.indexOf(words[i]) >= 0 ? 2 : 1;
    }
    return sum;
  }

  function show() {
    var words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    found.textContent = "";
    if (!words.length) return;
    var hits = [];
    pendulaIndex.forEach(function (entry, i) {
      var s = score(entry, words);
      if (s) hits.push([s, i]);
    });
    hits.sort(function (a, b) { return b[0] - a[0] || a[1] - b[1]; });
    hits.slice(0, 12).forEach(function (hit) {
      var entry = pendulaIndex[hit[1]], item = document.createElement("li");
      var link = document.createElement("a"), small = document.createElement("small");
      link.href = entry[2];
      link.textContent = entry[0];
      small.textContent = entry[1];
      item.append(link, small);
      found.append(item);
    });
    if (!hits.length) found.innerHTML = "<li>Nothing mentions this.</li>";
  }

  input.addEventListener("input", show);
  document.getElementById("search").addEventListener("submit", function (event) {
    event.preventDefault();
    var first = found.querySelector("a");
    if (first) location.href = first.href;
  });
})();
