% The domain of the robot assistant (RA) that watches and tidies a cluttered table.
%
% This is the domain of the paper, in the action language that docs/action_language.md describes.
% Classification of scenes, planning, diagnosis and explanation all come from this one text.
%
% The paper writes obj_relation(above, A, B) where this file writes above(A, B). The last argument
% of a relation is the reference object: above(A, B) says that A is above B.
%
% An axiom can have a name, and words that explanations use. `withheld` marks what the robot does
% not know from the start in the experiments and has to learn. Axioms are switched off by name.


% --- Sorts. The objects of a scene are added to `object` when it is seen.

sort entity.
sort object < entity.
sort robot < entity = {rob1}.
sort location = object + {table}.
sort size = {small, medium, large}.
sort surface = {flat, irregular}.

const tallest = 8.
sort level = 1..tallest.


% --- Statics. An attribute that is not known stays unknown.

static obj_size(object, size).
static obj_surface(object, surface).


% --- Fluents.

% Perceived: one position and one distance for every pair of objects, as the viewer sees them.
inertial fluent
    in(object, object), above(object, object), below(object, object), front(object, object),
    behind(object, object), right(object, object), left(object, object),
    touching(object, object), not_touching(object, object), far(object, object).

inertial fluent in_hand(robot, object).

defined fluent on(object, location), supported(object), held(object).
defined fluent near(object, object), next_to(object, object), beside(object, object).
defined fluent tower_height(object, level), small_base(object), irregular_below(object).

% What is to be estimated of a scene. Where no axiom speaks of an object, it is undecided.
estimated fluent stable(object), occluded(object).


% --- Actions. What is exogenous happens without the robot, and explains what it did not expect.

action pickup(robot, object), putdown(robot, object, location).
exogenous action fall(object).


% --- Converses, and the symmetry of distance. `in` has no converse among the relations.

below_above "Where one thing is above another, the other is below it.":
    below(B, A) if above(A, B).
above_below "Where one thing is below another, the other is above it.":
    above(B, A) if below(A, B).
behind_front "Where one thing is in front of another, the other is behind it.":
    behind(B, A) if front(A, B).
front_behind "Where one thing is behind another, the other is in front of it.":
    front(B, A) if behind(A, B).
left_right "Where one thing is right of another, the other is left of it.":
    left(B, A) if right(A, B).
right_left "Where one thing is left of another, the other is right of it.":
    right(B, A) if left(A, B).
touching_both "What touches a thing is touched by it.":
    touching(B, A) if touching(A, B).
not_touching_both "What does not touch a thing, though near, is not touched by it.":
    not_touching(B, A) if not_touching(A, B).
far_both "What is far from a thing has it far away.":
    far(B, A) if far(A, B).


% --- Relations and properties defined from them.

on_object "An object is on another if it is above and touches it.":
    on(A, B) if above(A, B), touching(A, B).
on_table "An object is on the table if it is on and in no other object and not in a hand.":
    on(A, table) if not supported(A), not held(A).

supported(A) if above(A, B), touching(A, B).
supported(A) if in(A, B).
held(A) if in_hand(R, A).

near(A, B) if touching(A, B).
near(A, B) if not_touching(A, B).

beside(A, B) if left(A, B).
beside(A, B) if right(A, B).
beside(A, B) if front(A, B).
beside(A, B) if behind(A, B).
next_to(A, B) if near(A, B), beside(A, B).

% The level in a stack, 1 on the table; several levels where an object stands on several others.
% All levels from `tallest` up count as `tallest`, whatever was perceived.
height_table "What is on the table is at the first level.":
    tower_height(A, 1) if on(A, table).
height_on "What is on an object is one level above it.":
    tower_height(A, N + 1) if on(A, B), tower_height(B, N).
height_in "What is in an object is at its level.":
    tower_height(A, N) if in(A, B), tower_height(B, N).
height_top "What is on an object at the highest level is there too.":
    tower_height(A, tallest) if on(A, B), tower_height(B, tallest).

% Directly, or through others.
small_below "An object on a small one has a small base.":
    small_base(A) if on(A, B), obj_size(B, small).
small_further_below "An object on one with a small base has a small base.":
    small_base(A) if on(A, B), small_base(B).

irregular_under "An object on one with an irregular surface has an irregular surface below it.":
    irregular_below(A) if on(A, B), obj_surface(B, irregular).
irregular_further_under "What is below an object is below everything on it.":
    irregular_below(A) if on(A, B), irregular_below(B).


% --- Stability and occlusion: given.

large_on_small "A large object on a small one is unstable.":
    normally -stable(A) if on(A, B), obj_size(A, large), obj_size(B, small).
tall_tower "An object above the fourth level of a tower is unstable.":
    normally -stable(A) if tower_height(A, N), N > 4.

% A default of the initial state belongs to the history: it bears on plans and diagnoses.
four_blocks "Structures with four or more blocks are unstable in the beginning.":
    initially normally -stable(A) if tower_height(A, N), N >= 4.


% --- Stability and occlusion: to be learned.

s1 withheld "An object that is above no other object is stable.":
    stable(A) if not above(A, B).
s2 withheld "An object with an irregular surface below it in its stack is unstable.":
    -stable(A) if irregular_below(A).
s3 withheld "An object with a small object below it in its stack is unstable.":
    normally -stable(A) if small_base(A).

o1 withheld "An object that is behind no other object is not occluded.":
    -occluded(A) if not behind(A, B).
o2 withheld "An object that is behind one object and above another is not occluded.":
    normally -occluded(A) if behind(A, B), above(A, C).
o3 withheld "An object that is behind another and above none is occluded.":
    normally occluded(A) if behind(A, B), not above(A, C).


% --- Picking up. What is in a hand stands in no relation to the rest.

pickup_holds "What is picked up is in the hand.":
    pickup(R, A) causes in_hand(R, A).
pickup_leaves "What is picked up leaves everything it was on, beside or under.":
    pickup(R, A) causes
        -in(A, B), -above(A, B), -below(A, B), -front(A, B), -behind(A, B), -right(A, B),
        -left(A, B), -touching(A, B), -not_touching(A, B), -far(A, B),
        -in(B, A), -above(B, A), -below(B, A), -front(B, A), -behind(B, A), -right(B, A),
        -left(B, A), -touching(B, A), -not_touching(B, A), -far(B, A).

pickup_held "What is in the hand cannot be picked up.":
    impossible pickup(R, A) if in_hand(R, A).
pickup_full "A hand that holds something picks up nothing else.":
    impossible pickup(R, A) if in_hand(R, B).
pickup_under "What carries something cannot be picked up.":
    impossible pickup(R, A) if on(B, A).
pickup_filled "What contains something cannot be picked up.":
    impossible pickup(R, A) if in(B, A).


% --- Putting down. What is put on an object lies to all others as that object does.

putdown_empties "What is put down is not in the hand any more.":
    putdown(R, A, B) causes -in_hand(R, A).
putdown_on "What is put on an object is above it and touches it, unless it falls.":
    putdown(R, A, B) causes above(A, B), touching(A, B) if not fall(A).
putdown_above "What is put on an object is above all that this object is above, unless it falls.":
    putdown(R, A, B) causes above(A, C), not_touching(A, C) if above(B, C), not fall(A).
putdown_front "What is put on an object is in front of what this is in front of, unless it falls.":
    putdown(R, A, B) causes front(A, C) if front(B, C), not fall(A).
putdown_behind "What is put on an object is behind what this is behind, unless it falls.":
    putdown(R, A, B) causes behind(A, C) if behind(B, C), not fall(A).
putdown_right "What is put on an object is right of what this is right of, unless it falls.":
    putdown(R, A, B) causes right(A, C) if right(B, C), not fall(A).
putdown_left "What is put on an object is left of what this is left of, unless it falls.":
    putdown(R, A, B) causes left(A, C) if left(B, C), not fall(A).

% `not`: a robot that does not know whether it holds a thing cannot put it down either.
putdown_held "What is not known to be in the hand cannot be put down.":
    impossible putdown(R, A, B) if not in_hand(R, A).
putdown_free "Nothing can be put on what is in a hand.":
    impossible putdown(R, A, B) if held(B).
putdown_covered "Nothing can be put on an object that carries another.":
    impossible putdown(R, A, B) if on(C, B), B != table.


% --- Falling: onto the table, away from everything, also out of a hand.

fall_leaves "What falls leaves everything it was on, beside or under.":
    fall(A) causes
        -in(A, B), -above(A, B), -below(A, B), -front(A, B), -behind(A, B), -right(A, B),
        -left(A, B), -touching(A, B), -not_touching(A, B), -far(A, B),
        -in(B, A), -above(B, A), -below(B, A), -front(B, A), -behind(B, A), -right(B, A),
        -left(B, A), -touching(B, A), -not_touching(B, A), -far(B, A).
fall_drops "What falls is in no hand.":
    fall(A) causes -in_hand(R, A).
fall_table "What is on the table does not fall.":
    impossible fall(A) if on(A, table).


% --- The robot's task in the paper.

goal reduce_clutter "Nothing is occluded, nothing unstable, and as little as can be on the table.":
    no occluded(X), no -stable(X), no in_hand(R, X), fewest on(X, table).
