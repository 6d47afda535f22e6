// How Sphinx's search orders its results: guides first, internals last. Points as by default.
var Scorer = {
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
  score: ([page, , , , points]) => points
    + (/^(tutorial|motions|feasibility|how-to\/|explanation\/|ros2|unitree)/.test(page) ? 30 : 0)
    - (page.includes("/internals/") ? 20 : 0),
};
