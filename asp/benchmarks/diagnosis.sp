% A robot carried boxes for ten steps. Some boxes are not where they should be: somebody carried
% them off, at steps unknown. docs/bench.md compares solving this with diagnosis.lp.

#const n = 10.

sorts
#room = {kitchen, office, lab, library, hall}.
#box = [box][1..10].
#robot = {rob}.
#thing = #box + #robot.
#bool = {true, false}.
#step = 0..n.
#fluent = loc(#thing, #room) + in_hand(#robot, #box).
#action = move(#robot, #room) + grasp(#robot, #box) + putdown(#robot, #box).
#event = carried_off(#box, #room).

predicates
holds(#fluent, #step).
occurs(#action, #step).
happened(#event, #step).
obs(#fluent, #bool, #step).
hpd(#action, #step).

rules
% What actions do.
holds(loc(R, L), I + 1) :- occurs(move(R, L), I).
holds(in_hand(R, B), I + 1) :- occurs(grasp(R, B), I).
-holds(in_hand(R, B), I + 1) :- occurs(putdown(R, B), I).

% What somebody else does.
holds(loc(B, L), I + 1) :- happened(carried_off(B, L), I).
:- happened(carried_off(B, L), I), holds(in_hand(R, B), I).
:- happened(carried_off(B, L), I), holds(loc(B, L), I).
:- happened(carried_off(B, L), I), happened(carried_off(B, M), I), L != M.

% Constraints of states.
holds(loc(B, L), I) :- holds(loc(R, L), I), holds(in_hand(R, B), I).
-holds(loc(T, L), I) :- holds(loc(T, M), I), L != M.
-holds(in_hand(R, B), I) :- holds(in_hand(R, C), I), B != C.

% When actions are impossible.
:- occurs(move(R, L), I), holds(loc(R, L), I).
:- occurs(grasp(R, B), I), holds(loc(R, L), I), not holds(loc(B, L), I).
:- occurs(putdown(R, B), I), not holds(in_hand(R, B), I).

% Inertia.
holds(F, I + 1) :- holds(F, I), not -holds(F, I + 1).
-holds(F, I + 1) :- -holds(F, I), not holds(F, I + 1).

% The history, and that it agrees with what is concluded.
occurs(A, I) :- hpd(A, I).
holds(F, 0) :- obs(F, true, 0).
-holds(F, 0) :- obs(F, false, 0).
:- obs(F, true, I), not holds(F, I).
:- obs(F, false, I), not -holds(F, I).

% Nothing is carried off unless there is no other explanation.
stolen : happened(carried_off(B, L), I) :+ I < n.

obs(loc(rob, hall), true, 0). obs(in_hand(rob, B), false, 0).
obs(loc(box1, hall), true, 0). obs(loc(box2, kitchen), true, 0). obs(loc(box3, office), true, 0).
obs(loc(box4, lab), true, 0). obs(loc(box5, library), true, 0). obs(loc(box6, hall), true, 0).
obs(loc(box7, kitchen), true, 0). obs(loc(box8, office), true, 0). obs(loc(box9, lab), true, 0).
obs(loc(box10, library), true, 0).

hpd(grasp(rob, box1), 0). hpd(move(rob, kitchen), 1). hpd(putdown(rob, box1), 2).
hpd(grasp(rob, box2), 3). hpd(move(rob, office), 4). hpd(putdown(rob, box2), 5).
hpd(grasp(rob, box3), 6). hpd(move(rob, lab), 7). hpd(putdown(rob, box3), 8).
hpd(move(rob, hall), 9).

obs(loc(box1, library), true, 10). obs(loc(box5, office), true, 9). obs(loc(box7, lab), true, 10). obs(loc(box9, hall), true, 3).


display
happened.
